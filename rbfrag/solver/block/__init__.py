"""Block geometry: sections, polygons, meshes, and arrays of blocks."""
