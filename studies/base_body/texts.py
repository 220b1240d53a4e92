"""Sentences of the report; names in braces are filled with the study's numbers."""

ASSUMPTIONS = (
    "Frequency and duration. The paper states neither omega_e nor the length of a manoeuvre. This study takes a period "
    "of {period} s, two oscillations, and {ramp} s for each connecting spline, so that the base turns with at most "
    "{rate} rad/s, below 0.01, and its accelerometer reads at most {accel} m/s². Without noise the choice does not "
    "matter; with noise it does, since the accelerations grow as omega_e squared.",
    "Speed. The paper's oscillation at that period moves the tip too fast for the flight rules of ETS-VII (50 mm/s "
    "and 5 deg/s); it would have to be {slow} times slower.",
    "Joint limits. The paper states ±π/2, but its printed optimum leaves these limits: {limits}. It was taken as "
    "printed.",
    "Joint zeros, axes and link frames. The paper states none. This study uses those of public ETS-VII models, so the "
    "same q may be another motion than the paper's.",
    "Extended position of the other joints. With these kinematics the tip is farthest from joint 3 with joints 4 to "
    "6 at ({wrist}) rad; they rest there throughout.",
    "Poorly exciting manoeuvre. The paper does not print its optimum. This study uses q = (0.68, −0.03, 1.04, −0.53, "
    "1.17, −0.37), which a search within the joint limits gave for the smallest rate about the third axis.",
    "Connecting splines. The paper's splines end at q1, where the cosine does not begin. In this study they meet "
    "position, speed and acceleration of the oscillation.",
    "Start. The base starts at rest relative to inertial space, its axes along zenith, flight direction and orbit "
    "normal. The paper plots the motion relative to the orbital frame.",
    "Inertia. The paper's true and guessed inertias are taken to be about the centre of mass. No rigid body could have "
    "the true inertia about the base's origin.",
    "Mass ratio. Links 2 to 6 of the public arm are 1/25 of the base, the whole arm is 1/18.8. For a ratio of 1/7, "
    "mass and inertia of the whole arm were scaled until links 2 to 6 are 1/7 of the base.",
    "Sensors. Rate and acceleration are read at 2 Hz, the accelerometer sits at (0.4, 0.3, 0.8) m. The paper "
    "integrates the accelerometer's signal to a velocity and adds squares in SI units. This study compares the reading "
    "as it is, and weights both sensors with 10⁻⁵.",
)

NOISE_FREE = (
    "The data come from the simulator of this package with a quarter of the fit's integration step; the tests repeat "
    "the case with data from an independent step-by-step integration of the joint-space equations. "
    "Levenberg-Marquardt with the exact Jacobian starts from the paper's initial guess, without a prior. The initial "
    "rate is known to be zero."
)

POOR = (
    "The peak rates of the poorly exciting manoeuvre about x, y, z are {peak} mrad/s. Without noise, poor excitation "
    "costs nothing but digits: the fit is as exact as the integration allows. If the paper's data came from the model "
    "that it fitted, the truth is the exact minimum of its sum of squares too, so its optimiser must have stopped "
    "before the minimum. With noise, a poorly exciting manoeuvre does cost: noise of 10⁻⁵ rad/s and 10⁻⁵ m/s² per "
    "sample leaves standard deviations of {mass} for the mass, {izz} for izz and {ixz} for ixz; with the well exciting "
    "manoeuvre they are {well}."
)

GRADIENT = (
    "Leaving the gravity gradient out of the model biases products of inertia most, by a percent and more. The errors "
    "that the paper prints for its identification have the same size, and its statement is confirmed that including "
    "the gradient is very important. The misfit that is left is {misfit} of a noise of 10⁻⁵ per sample, which cannot "
    "be seen in a plot of the residuals, but over all samples it adds up to chi² = {chi2}. With noise of that size the "
    "bias is up to {bias} standard deviations after one manoeuvre, and more manoeuvres do not remove it."
)

SAMPLED = (
    "The paper considers neither noise in this problem nor a posterior instead of a point. Here a star sensor of 2 "
    "seconds of arc and an accelerometer of 10⁻⁵ m/s² with an unknown constant bias (prior 10⁻⁴ m/s²) are read at 2 "
    "Hz. The joint encoders have 10⁻⁶ rad of noise, which the smoothing carries into the likelihood. The initial rate "
    "is unknown. There is one recording of the paper's manoeuvre, and the prior is centred on the paper's initial "
    "guess with a relative width of one. The posterior is sampled by emcee."
)

GRADES = (
    "Standard deviations are to first order at the truth, from the exact Jacobian, with the paper's manoeuvre, an "
    "unknown initial rate and an unknown accelerometer bias. The star sensor of 2 seconds of arc enters as an "
    "attitude. Where it is differenced, it enters as a rate of 2.7 × 10⁻⁵ rad/s per sample that is taken for white, "
    "which wastes most of its information. The last columns show where better accelerometers stop paying: at the "
    "knowledge of the arm, or at the encoders of 10⁻⁶ rad, whose noise is differentiated twice."
)

READINGS = (
    "The paper's reference added a noise of sigma 0.04 and reports an error of 2 %; on ETS-VII sigma was 0.009. "
    "Neither has a unit. In this table every sensor has noise of the same fraction of its signal's peak. The last "
    "column is the number of such manoeuvres that would have to be averaged for an error of 2 % in mass and moments."
)

ARM = (
    "Rigid motion never shows the scale of the masses: the equations are homogeneous in them, gravity gradient "
    "included. The scale comes from the arm, and the paper takes the arm as exact. A prior of 0.025 in a link's "
    "log-Cholesky coordinates, which is 5 % in its mass, makes the base's mass {ratio} times more uncertain, and no "
    "sensor can repair that. Only ratios, such as the centre of mass, stay accurate."
)

ARM_FLOOR = (
    "Six link masses with independent errors of 5 % leave their common scale known to about 2 %, which is the lower "
    "limit for mass and moments."
)

SLOW = (
    "The slow manoeuvre follows the same path {slow} times slower, as the flight rules of ETS-VII demand. The base "
    "turns with {rate} mrad/s. The accelerations fall with the square of the speed, and the mass, which needs them, is "
    "known less well. The other quantities are not: the star sensor sees the same rotation in more samples, and the "
    "gravity gradient has longer to act."
)
