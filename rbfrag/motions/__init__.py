"""Accelerograms: file formats, processing, intensity measures, spectra and directions.

A record stays as its file has it until a processing step is named. Blocks and their response are in
`solver`, storage in `db`.
"""
