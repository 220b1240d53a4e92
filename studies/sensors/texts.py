"""Sentences of the report."""

SHOWN = ("0.04 deg/s", "2″, 1e-5, 1e-5", "2″, 1e-7, 1e-6")
"""Levels of noise that are drawn."""

ASKED = (
    "Section 4.3 of the paper leaves open what noise does in three dimensions. It expects the 2 % error that its "
    "reference found in the plane with a noise of sigma 0.04, after filtering and polynomial fitting; it says that "
    "joints must be differentiated twice and the accelerometer integrated, with effects not yet analysed; and it "
    "names sensors. Here MuJoCo flies the paper's manoeuvre (27) with ETS-VII, noise is added again and again, and "
    "the base is identified with the arm known: by the integral method (21) as printed, by weighted variants, and by "
    "the package's likelihood."
)

LEVELS = (
    "The paper prints 0.04 and 0.009 without a unit. In rad/s 0.04 would be five times the base's peak rate here. "
    "They are read as degrees per second of the rates and degrees of the joints; the accelerometer, of which the "
    "plane had none, gets noise of the same share of its peak as the rates. The alternative, 4 % of each signal's "
    "peak, is there with joints of 10⁻⁵ rad.",
    "The star sensor's 2 seconds of arc are differenced at 2 Hz: √2 × 2″ / 0.5 s per sample, taken for white, which "
    "it is not; used as an attitude it would tell more (report on the base body). If 2″ means 2″ per second, the "
    "rates are 2.8 times better than here. The paper prints 10e−5 to 10e−9 m/s², read as 10⁻⁵ to 10⁻⁹.",
)

JOINTS = (
    "Rates and accelerations are used as read, weighted by their noise; the joints are treated in different ways: "
    "central differences; a Butterworth low-pass of fourth order, 0.2 Hz, forth and back, then differences; "
    "Savitzky-Golay over 21 samples, degree 5; one polynomial of the degree with the least Bayesian information "
    "criterion, over the whole recording or over each piece of (27); a smoothing spline by generalised "
    "cross-validation; and the package's smoother, an integrated Wiener process given the encoders' noise. 'Carried' "
    "is the package's likelihood, which knows what the smoother leaves uncertain; 'jolts unread' leaves out the "
    "base's samples within 2 s of where (27) meets its splines, where the joints' third derivative jumps.",
    "Actual / stated: root mean square error, bias included, over what the estimator states, lowest and highest of "
    "mass and moments; 1 is honest. Shift: mean difference from the first row on the same noise, which shows a "
    "treatment's distortion more sharply than its bias, whose Monte-Carlo error is that of the sensors' noise. Chi² "
    "per degree of freedom.",
)

RATES = (
    "The rates are treated in the same ways, the joints by the package's smoother, the accelerations as read. The "
    "estimator compares treated rates with untreated predictions, as the paper does. White noise needs no filter: "
    "least squares average it already, and every filter distorts. Chi² falls below 1 because the filter takes noise "
    "away; the standard deviation does not follow.",
)

INTEGRAL = (
    "In closed form, with one unknown: an acceleration of known shape s(t) and size A, white noise. The velocity of "
    "the noise is a random walk, with covariance min(t, u). Least squares that take it for white have, with S the "
    "integral of s,",
    "over whole periods of the cosine, whatever their number, and whether or not the constant of integration is "
    "known. The whole covariance loses nothing, because summation can be undone: of the samples' information only the"
    " part along the alternating signal +1, −1, +1 ..., which the trapezoidal rule cannot see, is gone. A constant "
    "bias b becomes the ramp b t; it changes the cosine's A by −2 b, but not at all where the acceleration itself is "
    "fitted.",
    "In the whole problem ten parameters and the initial rate are fitted, and the loss is greater, because the random"
    " walk resembles what slow parameters do to the velocity.",
)

LINEAR = (
    "With the arm known, (19) reads Phi_base p_base = −Phi_arm p_arm. The data are flown without gravity gradient, "
    "which (19) leaves out; joints, rates and accelerations are all treated alike. Least squares minimise as if Phi "
    "were exact. Its errors add their covariance to the normal matrix and so shrink the estimate, however many "
    "samples there are.",
    "Closed form: for large samples, from the variances of central differences and the derivatives of Phi, with no "
    "simulated noise.",
)

REFITS = (
    "The tables above are to first order about the truth, with the exact Jacobian: an estimator errs by a fixed matrix "
    "times the errors of the data. Nonlinear fits of some draws, started at the truth, show how far that holds. Where "
    "(21) errs by tens of percent, it does not: some of its fits run away, so that a mean square error says nothing, "
    "and the others err differently. Its figures at the highest noise are an order of magnitude."
)

ASSUMED = (
    "ETS-VII with the base of the paper and a public arm that is known exactly; the paper's q in (27) with the "
    "frequency assumed in the report on the base body: two periods of 30 s, splines of 30 s. The base starts at rest;"
    " the initial rate is unknown to every estimator, the attitude at the start known, the gravity gradient modelled.",
    "Rate, accelerometer and encoders every 0.5 s, noise white and independent. The accelerometer sits at (0.4, 0.3, "
    "0.8) m. It has no bias unless a row says so.",
    "Velocities are integrated in base axes, measured and predicted alike. Turning them into orbit axes first leaves "
    "the covariance of white noise as it is.",
    "No prior. Cut-off, window and degrees were set once, not tuned to the truth. Joints are differentiated by the "
    "same treatment that smooths them; all estimators integrate with 1 s steps, whose nodes and midpoints are the "
    "samples.",
    "The paper's procedure, as read here: rates and accelerations low-passed, joints fitted by piecewise polynomials,"
    " accelerations integrated, squares of SI units summed alike as in (21).",
    "Noise of the joints enters through their sensitivity at the same instant, to first order.",
)
