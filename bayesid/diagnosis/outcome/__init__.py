"""What follows from a verdict: table of candidates, gain, disturbance, joint torques, extended model."""
