"""Searches for the critical strength with its certificate, the critical scale of a record, and the
critical displacement. The proof of the certificate is docs/theory/critical.md.
"""
