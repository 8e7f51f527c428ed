"""Speed against peers and against the machine, as ratios measured in one run."""
