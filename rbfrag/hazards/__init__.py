"""Annual rates of failure: hazard curves, survival, event sets, losses and maps.

One rate integration serves all of them: the fragility over the rate density of the intensity
measure. Files of other tools are read in `exchange`; models and their intervals come from
`fragility`.
"""
