"""Jobs of the OpenQuake engine: what it exports, and what it stores."""
