"""Rock masses: random joint sets, the blocks sampled from them, and the fraction that fails.

Orientations and sizes follow stated distributions with a seed. Each block is an ordinary block of
`solver`, and answers come from `question`.
"""
