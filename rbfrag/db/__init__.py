"""The SQL store: schema, engine, writes and the named queries. SQL lives here alone."""
