"""The database: schema, keys, rows and named queries; the only SQL.

Functions take a connection; those that write leave beginning and end of the transaction to the
caller.
"""
