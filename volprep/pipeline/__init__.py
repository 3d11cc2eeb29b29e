"""From a scan and a scene to a package: the plan is made, stages run in order, the package gets its name."""
