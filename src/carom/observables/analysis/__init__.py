"""What several observables compute with: fits, drifts, moments, waves, quantiles, the precision to come.

Nothing here is an observable by itself.
"""
