"""What can be identified: by the structure of the robot, and by a study's manoeuvres, sensors and priors."""
