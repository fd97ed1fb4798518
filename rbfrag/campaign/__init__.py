"""Campaigns: the simulations to make, the workers that make them, and the rows they store.

A plan compares what is asked for with the natural keys in the database, so that stored results are
never computed again. The physics is in `solver` and the SQL in `db`; `campaign.kinds` connects
them.
"""
