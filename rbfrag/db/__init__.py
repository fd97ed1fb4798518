"""Database: schema, keys, rows and named queries; the only package with SQL.

Functions take a connection; those that write leave beginning and end of the transaction to the
caller. Natural keys make every insert repeatable. No physics and no statistics.
"""
