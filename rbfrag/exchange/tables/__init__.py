"""Tables of blocks as files: CSV, Excel workbooks, Parquet; one reader and one writer."""
