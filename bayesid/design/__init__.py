"""Design of the excitation: manoeuvres chosen by the posterior they lead to, within the limits of the robot."""
