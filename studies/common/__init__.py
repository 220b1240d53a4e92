"""What several studies share: ETS-VII, flights in MuJoCo, a Monte Carlo runner and the command line."""
