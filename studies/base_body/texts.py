"""Sentences of the report; names in braces are filled with the study's numbers."""

ASSUMED = (
    "Frequency and duration. The paper gives neither omega_e nor the length of a manoeuvre. Here: a period of "
    "{period} s, two oscillations, and {ramp} s for each connecting spline, so that the base turns with at most "
    "{rate} rad/s, below 0.01, and its accelerometer reads at most {accel} m/s². Without noise the choice does not "
    "matter; with noise the accelerations grow as omega_e squared.",
    "Speed. The paper's oscillation at that period moves the tip too fast for the flight rules of ETS-VII (50 mm/s "
    "and 5 deg/s); it would have to be {slow} times slower.",
    "Joint limits. The paper states ±π/2, but its printed optimum leaves them: {limits}. It was taken as printed.",
    "Joint zeros, axes and link frames. The paper states none; those of public ETS-VII models are used, so that the "
    "same q is not the same motion of the same arm.",
    "Extended position of the other joints. With these kinematics the tip is farthest from joint 3 with joints 4 to "
    "6 at ({wrist}) rad; they rest there throughout.",
    "Poor manoeuvre. Its optimum is not printed. Here q = (0.68, −0.03, 1.04, −0.53, 1.17, −0.37), found by a search "
    "within the joint limits for the least rate about the third axis.",
    "Connecting splines. The paper's splines end at q1, where its cosine is not; here they meet position, speed and "
    "acceleration of the oscillation.",
    "Start. The base starts at rest relative to inertial space, its axes along zenith, flight direction and orbit "
    "normal. The paper plots the motion relative to the orbital frame.",
    "Inertia about the centre of mass, in the paper's truth and guess alike: about the base origin no body could "
    "have the truth.",
    "Mass ratio. Links 2 to 6 of the public arm are 1/25 of the base, the whole arm is 1/18.8. For 1/7 mass and "
    "inertia of the whole arm were scaled until links 2 to 6 are 1/7.",
    "Sensors. Rate and accelerometer at 2 Hz, the accelerometer at (0.4, 0.3, 0.8) m. The paper integrates the "
    "accelerometer's signal to a velocity and sums squares of SI units; here its reading is compared as it is, and "
    "both sensors are weighted with 10⁻⁵.",
)

NOISE = (
    "Data come from the simulator of this package with a quarter of the integration step of the fit; the tests "
    "repeat the case with data from an independent step-by-step integration of the joint-space equations. "
    "Levenberg-Marquardt with the exact Jacobian starts from the paper's initial guess; the prior is left out. The "
    "initial rate is known to be zero.",
    "Peak rates of the poor manoeuvre about x, y, z: {peak} mrad/s. Without noise poor excitation costs nothing but "
    "digits: the fit is exact to what the integration allows. If the paper's data came from its own model, the truth "
    "is the exact minimum of its sum of squares too, so that its optimiser must have stopped short of it. What a "
    "poor manoeuvre does cost shows with noise: with 10⁻⁵ rad/s and 10⁻⁵ m/s² per sample the mass is known to "
    "{mass}, izz to {izz}, ixz to {ixz}; with the well exciting manoeuvre to {well}.",
    "Largest relative error in each group. Misfit: root mean square residual over 10⁻⁵ rad/s and 10⁻⁵ m/s².",
    "Leaving the gravity gradient out of the model biases products of inertia most, by a percent and more. That is "
    "the size of the errors the paper prints for its own identification, and its statement that including the "
    "gradient is very important is confirmed. The misfit it leaves is {misfit} of a noise of 10⁻⁵ per sample, which "
    "no eye would find in a residual; its sum over all samples, chi² = {chi2}, is another matter. With noise of that "
    "size the bias is up to {bias} standard deviations after one manoeuvre, and remains after many.",
)

SAMPLED = (
    "What the paper did not do: noise, and a posterior instead of a point. A star sensor of 2 seconds of arc and an "
    "accelerometer of 10⁻⁵ m/s² with an unknown constant bias (prior 10⁻⁴ m/s²), both at 2 Hz, joint encoders of "
    "10⁻⁶ rad whose noise the smoothing carries into the likelihood, and an unknown initial rate. One recording of "
    "the paper's manoeuvre; the prior is centred on the paper's initial guess with a relative width of one. Sampled "
    "by emcee."
)

GRADES = (
    "Widths to first order at the truth, from the exact Jacobian, with the paper's manoeuvre, unknown initial rate "
    "and unknown accelerometer bias. The star sensor of 2 seconds of arc enters as an attitude, or (differenced) as "
    "a rate of 2.7 × 10⁻⁵ rad/s per sample taken for white, which wastes most of it. The last columns show where "
    "better accelerometers stop paying: at the knowledge of the arm, or at the encoders of 10⁻⁶ rad, whose noise is "
    "differentiated twice."
)

READINGS = (
    "The paper's reference introduced a noise of sigma 0.04 and found an error of 2 %; on ETS-VII sigma was 0.009. "
    "No unit is given. Every sensor here gets noise of the same fraction of its signal's peak. The last column is "
    "how many such manoeuvres would have to be averaged for 2 % in mass and moments.",
    "What each reading would mean: relative standard deviation from one manoeuvre at 2 Hz, without prior and with an "
    "exact arm.",
)

ARM = (
    "Rigid motion never gives the scale of the masses: the equations are homogeneous in them, gravity gradient "
    "included. The scale comes from the arm, and the paper takes the arm as exact. A prior of 0.025 in a link's "
    "log-Cholesky coordinates, 5 % in its mass, makes the base's mass {ratio} times more uncertain, and no sensor "
    "mends that. Only ratios, such as the centre of mass, remain sharp.",
    "Six link masses with independent errors of 5 % leave their common scale known to about 2 %: the floor of mass "
    "and moments.",
    "Slow: the same path {slow} times slower, as the rules of ETS-VII demand. The base turns with {rate} mrad/s; "
    "accelerations fall with the square of the speed, and the mass, which needs them, is known less well. The rest is "
    "not: the star sensor sees the same rotation in more samples, and the gravity gradient has longer to act.",
)
