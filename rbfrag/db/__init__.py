"""The database: schema, keys, rows and named queries; the only SQL."""
