"""Reports as PDF or HTML: headline, warnings, tables and figures of one question.

The contents are those of the answer's `Result`; here they are only laid out.
"""
