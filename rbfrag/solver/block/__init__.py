"""The block: geometry, arrays of blocks, polygons, files."""
