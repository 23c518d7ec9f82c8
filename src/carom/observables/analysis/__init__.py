"""What several observables compute with: fits, drifts, moments, waves, quantiles, the precision to come."""
