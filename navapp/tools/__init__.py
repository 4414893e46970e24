"""Hand-held tools that carry a printed plate: where they are, and how they lie to the plan."""
