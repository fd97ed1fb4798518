"""HTTP API and web page.

A request is translated into fields, answered by the public functions, and returned as the
`Result`'s document. The page shows what the service sends and computes nothing.
"""
