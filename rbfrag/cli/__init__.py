"""Command line: one file a command, options from `vocabulary`, one printer for all answers.

A command translates words into fields, calls one public function and prints its `Result`. Nothing
is computed here.
"""
