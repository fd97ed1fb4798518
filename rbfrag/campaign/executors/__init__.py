"""Executors of a campaign: processes of this machine, or a Dask cluster."""
