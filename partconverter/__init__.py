"""From a CAD assembly (ACIS SAT text) to numerically smooth cylinders."""
