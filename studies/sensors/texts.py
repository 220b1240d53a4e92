"""Sentences of the report."""

SHOWN = ("0.04 deg/s", "2″, 1e-5, 1e-5", "2″, 1e-7, 1e-6")
"""Levels of noise that are drawn."""

QUESTION = (
    "Section 4.3 of the paper leaves open what noise does in three dimensions. It expects the error of 2 % that its "
    "reference had in the plane with a noise of sigma 0.04, after filtering and polynomial fitting. It says that "
    "joints must be differentiated twice and the accelerometer integrated, with effects not yet analysed; and it "
    "names sensors. In this study MuJoCo flies the paper's manoeuvre (27) with ETS-VII, and noise is added many times. "
    "The base is identified with the arm known: by the integral method (21) as printed, by weighted variants, and by "
    "the package's likelihood."
)

LEVELS = (
    "The paper prints 0.04 and 0.009 without a unit. In rad/s, 0.04 would be five times the base's peak rate here. "
    "Both are read as degrees per second of the rates and degrees of the joints. The accelerometer, which the robot in "
    "the plane did not have, gets noise of the same share of its peak as the rates. The alternative, 4 % of each "
    "signal's peak, has joints of 10⁻⁵ rad.",
    "The star sensor's 2 seconds of arc are differenced at 2 Hz, which gives √2 × 2″ / 0.5 s per sample. This noise is "
    "taken for white, which it is not; used as an attitude the sensor would tell more (report on the base body). If 2″ "
    "means 2″ per second, the rates are 2.8 times better than here. The paper prints 10e−5 to 10e−9 m/s², which is "
    "read as 10⁻⁵ to 10⁻⁹.",
)

JOINTS = (
    "Rates and accelerations are used as read, weighted by their noise. The joints are treated in different ways: "
    "central differences; a Butterworth low-pass of fourth order, 0.2 Hz, forward and backward, then differences; "
    "Savitzky-Golay over 21 samples, degree 5; one polynomial of the degree with the least Bayesian information "
    "criterion, over the whole recording or over each piece of (27); a smoothing spline by generalised "
    "cross-validation; and the package's smoother, an integrated Wiener process given the encoders' noise. The row "
    "'likelihood' is the package's likelihood, which knows the uncertainty that the smoother leaves. 'Junctions left "
    "out' is without the base's samples within 2 s of the junctions of (27) with its splines, where the joints' third "
    "derivative jumps.",
    "Actual / stated is the root mean square error, bias included, over what the estimator states, lowest and highest "
    "of mass and moments; an honest estimator has 1. The shift is the mean difference from the first row on the same "
    "noise. It shows a treatment's distortion more precisely than the bias, whose Monte-Carlo error is that of the "
    "sensors' noise. Chi² is per degree of freedom.",
)

RATES = (
    "The rates are treated in the same ways, with the joints treated by the package's smoother and the accelerations "
    "as read. The estimator compares treated rates with untreated predictions, as the paper does. White noise needs no "
    "filter: least squares average it already, and every filter distorts. Chi² falls below 1 because the filter "
    "removes noise; the standard deviation does not decrease.",
)

INTEGRAL = (
    "In closed form, with one unknown: an acceleration has the known shape s(t), the size A, and white noise. The "
    "velocity of the noise is a random walk, with covariance min(t, u). Let S be the integral of s. Least squares that "
    "take the walk for white noise have the ratio of variances",
    "over whole periods of the cosine, whatever their number, and whether or not the constant of integration is known. "
    "The full covariance loses nothing, because summation can be undone. Of the samples' information only the part "
    "along the alternating signal +1, −1, +1 ... is lost, which the trapezoidal rule cannot see. A constant bias b "
    "becomes the ramp b t. It changes the cosine's A by −2 b, but not at all where the acceleration itself is fitted.",
    "In the complete problem ten parameters and the initial rate are fitted, and the loss is greater, because the "
    "random walk resembles what slow parameters do to the velocity.",
)

LINEAR = (
    "With the arm known, (19) reads Phi_base p_base = −Phi_arm p_arm. The data are flown without gravity gradient, "
    "which (19) leaves out; joints, rates and accelerations are all treated alike. Least squares take Phi as exact. "
    "Its errors add their covariance to the normal matrix and so reduce the estimate, however many samples there are.",
    "The closed form is for large samples. It follows from the variances of central differences and the derivatives of "
    "Phi, with no simulated noise.",
)

REFITS = (
    "The tables above are to first order about the truth, with the exact Jacobian: the error of an estimator is a "
    "fixed matrix times the errors of the data. Nonlinear fits to further sets of noise, started at the truth, show "
    "how far that holds. It does not hold where (21) has errors of tens of percent: some of its fits diverge, so that "
    "a mean square error has no meaning, and the others have other errors. Its figures at the highest noise are an "
    "order of magnitude."
)

ASSUMPTIONS = (
    "ETS-VII has the base of the paper and a public arm that is known exactly. The manoeuvre has the paper's q in (27) "
    "with the frequency assumed in the report on the base body: two periods of 30 s, splines of 30 s. The base starts "
    "at rest. All estimators take the initial rate as unknown and the initial attitude as known, and model the gravity "
    "gradient.",
    "Rate, accelerometer and encoders are sampled every 0.5 s, with white and independent noise. The accelerometer "
    "sits at (0.4, 0.3, 0.8) m. It has no bias unless a row says so.",
    "Velocities are integrated in base axes, measured and predicted alike. Turning the accelerations into orbit axes "
    "first would leave the covariance of white noise as it is.",
    "There is no prior. Cut-off, window and degrees were set once and not adjusted to the truth. The treatment that "
    "smooths the joints also differentiates them. All estimators integrate with steps of 1 s, whose nodes and "
    "midpoints are the samples.",
    "The paper's procedure is read as follows: rates and accelerations are low-passed, joints are fitted by piecewise "
    "polynomials, accelerations are integrated, and squares of SI units are added with equal weights as in (21).",
    "Noise of the joints enters to first order, through the sensitivity of the readings to the joints at the same "
    "time.",
)
