"""Jobs of the OpenQuake engine: its exports and its datastore."""
