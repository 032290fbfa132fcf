"""From the meshed mid-surface of a belt to a bonded-particle belt."""
