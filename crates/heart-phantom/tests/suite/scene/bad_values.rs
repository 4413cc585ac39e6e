//! Every field of a scene with invalid values.

use super::{FULL, error_of};
use heart_phantom::Scene;

/// Text of the file, field of the error, and words of its message.
const BAD: &[(&str, &str, &str)] = &[
    (
        "[heart]\nlaw = 'per-volume'",
        "heart.law",
        "per-material-length",
    ),
    (
        "[heart]\nmaterial = 'jelly'",
        "heart.material",
        "neo_hookean",
    ),
    (
        "[heart]\nmaterial = { gent = { mu = 400.0, jm = -1.0, thickness = 0.5 } }",
        "heart.material.gent.jm",
        "positive",
    ),
    (
        "[heart]\ndiscretisation = 'fine'",
        "heart.discretisation",
        "differences",
    ),
    (
        "[heart]\ndiscretisation = { differences = { nodes = 3 } }",
        "heart.discretisation.differences.nodes",
        "11",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 2, per_piece = 1, tolerance = 1e-4 } }",
        "heart.discretisation.spectral.degree",
        "4",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 8, per_piece = 0, tolerance = 1e-4 } }",
        "heart.discretisation.spectral.per_piece",
        "1",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 8, per_piece = 1, tolerance = 0.0 } }",
        "heart.discretisation.spectral.tolerance",
        "between",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 8, per_piece = 1, tolerance = 1.0 } }",
        "heart.discretisation.spectral.tolerance",
        "between",
    ),
    (
        "[heart.inner]\nlength = -1.0\nradius = 1.0\nstiffness = 1.0",
        "heart.inner.length",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nradius = nan\nstiffness = 1.0",
        "heart.inner.radius",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nradius = 1.0\nstiffness = 0.0",
        "heart.inner.stiffness",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nwidth = 1.0",
        "heart.inner.width",
        "stiffness",
    ),
    (
        "[heart.outer]\nlength = inf\nradius = 3.0\nstiffness = 1.0",
        "heart.outer.length",
        "between",
    ),
    (
        "[heart.outer]\nlength = 7.0\nradius = 2.0\nstiffness = 1.0",
        "heart.outer.length",
        "apex",
    ),
    (
        "[heart.outer]\nlength = 8.5\nradius = 1.0\nstiffness = 1.0",
        "heart.outer.radius",
        "1.75",
    ),
    (
        "[heart.outer]\nlength = 8.5\nradius = 3.0\nstiffness = -2.0",
        "heart.outer.stiffness",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 0.0",
        "cycle.beats_per_minute",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 'fast'",
        "cycle.beats_per_minute",
        "a number",
    ),
    ("[cycle]\ncurve = 'square'", "cycle.curve", "sinusoid"),
    (
        "[cycle]\ncurve = { sampled = [1.0] }",
        "cycle.curve.sampled",
        "3",
    ),
    (
        "[cycle]\ncurve = { sampled = [1.0, 1.0, 1.0] }",
        "cycle.curve.sampled",
        "range",
    ),
    (
        "[cycle]\ncurve = { sampled = [1.0, inf, 1.0] }",
        "cycle.curve.sampled",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 200.0\ncurve = 'physiological'",
        "cycle.curve",
        "140",
    ),
    (
        "[cycle]\nvolume = { gain = -0.1 }",
        "cycle.volume.gain",
        "between",
    ),
    (
        "[cycle]\nvolume = { ejection_fraction = 1.0 }",
        "cycle.volume.ejection_fraction",
        "between",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 150.0, esv = 50.0 } }",
        "cycle.volume.volumes.esv",
        "reference volume",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 100.0, esv = 110.0 } }",
        "cycle.volume.volumes.edv",
        "end-systolic",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 1e9, esv = 110.0 } }",
        "cycle.volume.volumes.edv",
        "between",
    ),
    ("[cycle]\nvolume = 0.6", "cycle.volume", "{ gain = 0.6 }"),
    ("[pose]\ncentre = nan", "pose.centre", "between"),
    ("[pose]\nrotate_x = 400.0", "pose.rotate_x", "360"),
    ("[pose]\nrotate_y = nan", "pose.rotate_y", "between"),
    ("[pose]\nrotate_z = -1e9", "pose.rotate_z", "between"),
    ("[pose]\nshift = [0.0, inf, 0.0]", "pose.shift", "between"),
    ("[pose]\nshift = [0.0, 1.0]", "pose.shift", "3"),
    (
        "[activity]\ncavity = { concentration = -1.0 }",
        "activity.cavity.concentration",
        "between",
    ),
    (
        "[activity]\nwall = { total = nan }",
        "activity.wall.total",
        "between",
    ),
    ("[activity]\nwall = 1.0", "activity.wall", "{ total = "),
    (
        "[activity]\ncavity = { total = inf }",
        "activity.cavity.total",
        "between",
    ),
    (
        "[activity]\nwall = { concentration = nan }",
        "activity.wall.concentration",
        "between",
    ),
    ("[attenuation]\ncoefficient = 0.15", "attenuation", "medium"),
    (
        "[attenuation]\ncoefficient = -0.1\nmedium = 'heart'",
        "attenuation.coefficient",
        "between",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = 'lead'",
        "attenuation.medium",
        "torso",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [nan, 0.0], semi_axes = [1.0, 1.0] } }",
        "attenuation.medium.torso.centre",
        "between",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [0.0, 0.0], semi_axes = [1.0, 0.0] } }",
        "attenuation.medium.torso.semi_axes",
        "between",
    ),
    (
        "[output]\nwrite = ['attenuation']",
        "output.write",
        "needs a section",
    ),
    (
        "[background]\nconcentration = -0.1\ncentre = [0.0, 0.0]\nsemi_axes = [9.0, 8.0]",
        "background.concentration",
        "between",
    ),
    (
        "[background]\nconcentration = 0.1\ncentre = [0.0, inf]\nsemi_axes = [9.0, 8.0]",
        "background.centre",
        "between",
    ),
    (
        "[background]\nconcentration = 0.1\ncentre = [0.0, 0.0]\nsemi_axes = [9.0, -8.0]",
        "background.semi_axes",
        "between",
    ),
    ("[[defects]]\ns = [0.1, 0.2]", "defects.1", "missing field"),
    (
        "[[defects]]\nlayers = [0.5, 0.2]\ns = [0.1, 0.2]\nazimuths_degrees = [0.0, 90.0]\nactivity = 0.0",
        "defects.1.layers",
        "from < to",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.6]\nazimuths_degrees = [0.0, 90.0]\nactivity = 0.0",
        "defects.1.s",
        "0.5",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths_degrees = [0.0, 400.0]\nactivity = 0.0",
        "defects.1.azimuths_degrees",
        "360",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths_degrees = [nan, 40.0]\nactivity = 0.0",
        "defects.1.azimuths_degrees",
        "between",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths_degrees = [0.0, 40.0]\nactivity = -1.0",
        "defects.1.activity",
        "between",
    ),
    ("[blur]\nfwhm = -1.0", "blur.fwhm", "between"),
    ("[blur]\nfwhm = 17.0", "blur.fwhm", "16"),
    (
        "[noise]\ncounts = { total = 0.0 }\nseed = 1",
        "noise.counts.total",
        "between",
    ),
    (
        "[noise]\ncounts = { per_unit = nan }\nseed = 1",
        "noise.counts.per_unit",
        "between",
    ),
    (
        "[noise]\ncounts = 5.0\nseed = 1",
        "noise.counts",
        "{ per_unit = ",
    ),
    (
        "[noise]\ncounts = 'expected'\nseed = 1",
        "noise.counts",
        "[counting]",
    ),
    (
        "[noise]\ncounts = { total = 1e6 }\nseed = 1\n[counting]\nsensitivity = 80.0\ndecay = 'none'",
        "noise.counts",
        "expected",
    ),
    (
        "[counting]\nsensitivity = 0.0\ndecay = 'none'",
        "counting.sensitivity",
        "between",
    ),
    (
        "[counting]\nsensitivity = nan\ndecay = 'none'",
        "counting.sensitivity",
        "between",
    ),
    (
        "[counting]\nsensitivity = 80.0\ndecay = 'tc-98'",
        "counting.decay",
        "tc-99m",
    ),
    (
        "[counting]\nsensitivity = 80.0\ndecay = { half_life_hours = -1.0 }",
        "counting.decay.half_life_hours",
        "between",
    ),
    (
        "[counting]\nsensitivity = 80.0\ndecay = 'none'\n[acquisition]\nmode = 'instants'",
        "acquisition.mode",
        "exposure",
    ),
    (
        "[counting]\nsensitivity = 80.0\ndecay = 'none'\n[acquisition]\nmode = { exposure = { seconds = 0.0 } }",
        "acquisition.mode.exposure.seconds",
        "between",
    ),
    (
        "[noise]\ncounts = { per_unit = 1.0 }\nseed = -1",
        "noise.seed",
        "a non-negative integer",
    ),
    ("[camera]\nviews = 0", "camera.views", "between 1"),
    (
        "[camera]\nviews = -3",
        "camera.views",
        "a non-negative integer",
    ),
    (
        "[camera]\nviews = 10000\nbins = 8192",
        "camera.views",
        "at most",
    ),
    ("[camera]\narc = 0.0", "camera.arc", "between"),
    ("[camera]\nstart = inf", "camera.start", "between"),
    ("[camera]\nbins = 1", "camera.bins", "between 2"),
    ("[camera]\nrows = 0", "camera.rows", "between 1"),
    ("[camera]\npitch = [0.0, 0.1]", "camera.pitch", "between"),
    ("[camera]\npitch = 0.1", "camera.pitch", "array"),
    (
        "[camera]\nrotation = 'wobbling'",
        "camera.rotation",
        "step-and-shoot",
    ),
    (
        "[camera]\nseconds_per_view = 0.0",
        "camera.seconds_per_view",
        "between",
    ),
    (
        "[camera]\nseconds_per_view = 0.5\nrotation = 'continuous'",
        "camera.seconds_per_view",
        "one cardiac cycle",
    ),
    (
        "[camera]\nrotation = 'continuous'\nseconds_per_view = 1e6\n[acquisition]\naccuracy = { steps = 4096 }",
        "camera.seconds_per_view",
        "the limit is 1.6777216e7",
    ),
    (
        "[camera]\nrotation = 'continuous'\nseconds_per_view = 4.0\n[breathing]\nshift = [0.0, 0.0, 1.0]\n[blur]\nfwhm = 1.0\n[acquisition]\naccuracy = { steps = 256 }",
        "acquisition.accuracy.steps",
        "must be smaller",
    ),
    (
        "[camera]\nseconds_per_view = 1e6\n[breathing]\nshift = [0.0, 0.0, 1.0]",
        "camera.seconds_per_view",
        "heartbeats and breaths during all views; the limit is 1.2e5",
    ),
    (
        "[camera]\nrotation = 'continuous'\nseconds_per_view = 0.8\n[acquisition]\nmode = { gated = { gates = 8 } }",
        "camera.seconds_per_view",
        "gate 0 of 8 does not occur during view 14; one cardiac cycle, 0.923",
    ),
    ("[camera]\nradius = -1.0", "camera.radius", "between"),
    (
        "[camera]\nradius = 'near'",
        "camera.radius",
        "contour = { gap",
    ),
    (
        "[camera]\nradius = { per_view = [20.0, 21.0] }",
        "camera.radius.per_view",
        "90, one for each view",
    ),
    (
        "[camera]\nradius = { ellipse = { semi_axes = [20.0, -1.0] } }",
        "camera.radius.ellipse.semi_axes",
        "between",
    ),
    (
        "[camera]\nradius = { contour = { gap = nan } }",
        "camera.radius.contour.gap",
        "between",
    ),
    ("[camera]\nheads = 'three'", "camera.heads", "one"),
    (
        "[camera]\nheads = { two = { angle = 361.0 } }",
        "camera.heads.two.angle",
        "between",
    ),
    ("[camera]\nsamples = 'corners'", "camera.samples", "centres"),
    (
        "[camera]\ngeometry = 'helix'",
        "camera.geometry",
        "parallel",
    ),
    (
        "[camera]\ngeometry = { cone = { source_to_isocentre = 60.0, source_to_detector = 50.0 } }\n[output]\nwrite = ['projections']",
        "camera.geometry",
        "between 60",
    ),
    ("[chest]\ntrunk = -0.1", "chest.trunk", "between"),
    ("[chest]\nlungs = nan", "chest.lungs", "between"),
    ("[chest]\nliver = 1e13", "chest.liver", "between"),
    ("[chest]\nliver = 1e-26", "chest.liver", "at least 1e-25"),
    (
        "[activity]\nwall = { concentration = 1e-44 }",
        "activity.wall.concentration",
        "must be 0 or at least 1e-25",
    ),
    ("[chest]\nspine = -1.0", "chest.spine", "between"),
    (
        "[acquisition]\nmode = 'long'",
        "acquisition.mode",
        "whole-cycle",
    ),
    (
        "[acquisition]\nmode = { static = { phase = 1.5 } }",
        "acquisition.mode.static.phase",
        "between",
    ),
    (
        "[acquisition]\nmode = { exposure = { seconds = 2.0 } }",
        "acquisition.mode.exposure.seconds",
        "camera.seconds_per_view, 1",
    ),
    (
        "[acquisition]\nmode = { gated = { gates = 0 } }",
        "acquisition.mode.gated.gates",
        "between",
    ),
    (
        "[acquisition]\naccuracy = { steps = 7 }",
        "acquisition.accuracy.steps",
        "even",
    ),
    (
        "[acquisition]\naccuracy = { steps = 0 }",
        "acquisition.accuracy.steps",
        "between",
    ),
    (
        "[acquisition]\naccuracy = { tolerance = 0.0 }",
        "acquisition.accuracy.tolerance",
        "between",
    ),
    (
        "[[organs]]\nshape = { ellipsoid = { centre = [0.0, 0.0, 0.0], semi_axes = [1.0, 0.0, 1.0] } }\nactivity = 0.1\nattenuation = 0.1",
        "organs.1.shape.ellipsoid.semi_axes",
        "between",
    ),
    (
        "[[organs]]\nshape = { cylinder = { centre = [0.0, 0.0], semi_axes = [9.0, 9.0] } }\nactivity = -0.1\nattenuation = 0.1",
        "organs.1.activity",
        "between",
    ),
    (
        "[[organs]]\nshape = { cylinder = { centre = [0.0, 0.0], semi_axes = [9.0, 9.0] } }\nactivity = 0.1\nattenuation = 0.1",
        "organs.1",
        "the heart needs [attenuation]",
    ),
    (
        "[[organs]]\nshape = { cylinder = { centre = [0.0, 0.0], semi_axes = [9.0, 9.0] } }\nactivity = 0.1\nattenuation = 0.1\n\
         [attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [0.0, 0.0], semi_axes = [9.0, 9.0] } }",
        "attenuation.medium",
        "must be heart",
    ),
    (
        "[[organs]]\nshape = { cylinder = { centre = [0.0, 0.0], semi_axes = [9.0, 9.0] } }\nactivity = 0.1\nattenuation = 0.1\n\
         [background]\nconcentration = 0.1\ncentre = [0.0, 0.0]\nsemi_axes = [9.0, 9.0]",
        "background",
        "cannot be combined",
    ),
    (
        "[reconstruction]\nwindow = 'hat'",
        "reconstruction.window",
        "hann",
    ),
    (
        "[reconstruction]\nwindow = { butterworth = { order = 0 } }",
        "reconstruction.window.butterworth.order",
        "between",
    ),
    (
        "[reconstruction]\nwindow = { custom = [1.0] }",
        "reconstruction.window.custom",
        "between",
    ),
    (
        "[reconstruction]\nwindow = { custom = [1.0, nan] }",
        "reconstruction.window.custom",
        "between",
    ),
    (
        "[reconstruction]\ncutoff = 1.5",
        "reconstruction.cutoff",
        "between",
    ),
    (
        "[reconstruction]\npixels = 0",
        "reconstruction.pixels",
        "between",
    ),
    (
        "[reconstruction]\npixels = 8192",
        "reconstruction.pixels",
        "at most",
    ),
    (
        "[reconstruction]\nfilter_fwhm = 0.0",
        "reconstruction.filter_fwhm",
        "between 0.001 and 100",
    ),
    (
        "[camera]\npitch = [1e-5, 1e-5]\n[reconstruction]\nfilter_fwhm = 20.0",
        "reconstruction.filter_fwhm",
        "and 10",
    ),
    (
        "[reconstruction]\nfilter_fwhm = 1.0\nregion = { x = [0, 4], y = [0, 4] }",
        "reconstruction.filter_fwhm",
        "region",
    ),
    (
        "[reconstruction]\npixel = 0.0",
        "reconstruction.pixel",
        "between",
    ),
    (
        "[reconstruction]\nregion = { x = [5, 5], y = [0, 9] }",
        "reconstruction.region.x",
        "from < to",
    ),
    (
        "[reconstruction]\nregion = { x = [1000, 6], y = [0, 9] }",
        "reconstruction.region.x",
        "from < to",
    ),
    (
        "[reconstruction]\nregion = { x = [5, 6], y = [0, 257] }",
        "reconstruction.region.y",
        "256",
    ),
    (
        "[reconstruction]\narc = 'half'",
        "reconstruction.arc",
        "rescale",
    ),
    (
        "[reconstruction]\narc = 'complete'\n[camera]\narc = 90.0",
        "camera.arc",
        "180",
    ),
    ("[camera]\nviews = 1", "camera.views", "1 distinct"),
    ("[camera]\nviews = 2", "camera.views", "2 distinct"),
    (
        "[camera]\nviews = 8\narc = 3600.0",
        "camera.arc",
        "at least 3",
    ),
    ("[truth]\ntolerance = 0.0", "truth.tolerance", "between"),
    (
        "[cycle]\nav_plane_displacement = -1.0",
        "cycle.av_plane_displacement",
        "between 0 and 11.25",
    ),
    (
        "[twist]\ninner_degrees = [0.0, 400.0]\nouter_degrees = [0.0, 1.0]",
        "twist.inner_degrees",
        "360",
    ),
    (
        "[twist]\ninner_degrees = [0.0, nan]\nouter_degrees = [0.0, 1.0]",
        "twist.inner_degrees",
        "360",
    ),
    (
        "[twist]\ninner_degrees = [0.0, 4.0]\nouter_degrees = [1.0]",
        "twist.outer_degrees",
        "between 2",
    ),
    (
        "[[points]]\nlayer = 1.5\ns = 0.1\nazimuth_degrees = 0.0",
        "points.1.layer",
        "between",
    ),
    (
        "[[points]]\nlayer = 0.5\ns = 0.6\nazimuth_degrees = 0.0",
        "points.1.s",
        "between",
    ),
    (
        "[[points]]\nlayer = 0.5\ns = 0.5\nazimuth_degrees = 1000.0",
        "points.1.azimuth_degrees",
        "720",
    ),
    (
        "[output]\nwrite = ['motion']\nvolumes = 'interfile-stir'",
        "output.volumes",
        "nrrd",
    ),
    (
        "[beats]\nintervals = { list = [0.9, 0.1] }",
        "beats.intervals.list",
        "between",
    ),
    (
        "[beats]\nintervals = { list = [] }",
        "beats.intervals.list",
        "between 1",
    ),
    (
        "[beats]\nintervals = { random = { deviation = 3.0, ectopic = 0.0, seed = 1 } }",
        "beats.intervals.random.deviation",
        "between",
    ),
    (
        "[beats]\nintervals = { random = { deviation = 0.1, ectopic = 0.6, seed = 1 } }",
        "beats.intervals.random.ectopic",
        "between 0 and 0.5",
    ),
    (
        "[cycle]\nbeats_per_minute = 60.0\ncurve = { sampled = [1.0, 2.0, 1.5] }\n[beats]\nintervals = { random = { deviation = 0.0, ectopic = 0.125, seed = 1 } }",
        "beats.intervals.random.ectopic",
        "is 0.125; R-R interval of an ectopic beat, 0.6 of the period, is 0.6,",
    ),
    (
        "[camera]\nseconds_per_view = 10.0\n[acquisition]\nmode = { exposure = { seconds = 0.25 } }\n[breathing]\nshift = [0.0, 0.0, 1.0]\ngates = { phase = 2 }",
        "acquisition.mode.exposure.seconds",
        "does not occur in the time of view 1",
    ),
    (
        "[beats]\nintervals = { list = [0.9] }\naccepted = [1.0, 0.5]",
        "beats.accepted",
        "at least 1",
    ),
    (
        "[beats]\nintervals = { list = [0.9] }\ngated_by = 'phase'",
        "beats.gated_by",
        "time-after-r",
    ),
    (
        "[breathing]\nshift = [0.0, 0.0, 200.0]",
        "breathing.shift",
        "between",
    ),
    (
        "[breathing]\nrotation_degrees = [0.0, 200.0, 0.0]",
        "breathing.rotation_degrees",
        "180",
    ),
    ("[breathing]\nperiod = 0.0", "breathing.period", "between"),
    ("[breathing]\nstart = 1.5", "breathing.start", "between"),
    (
        "[breathing]\ncurve = { lujan = { n = 0 } }",
        "breathing.curve.lujan.n",
        "between 1 and 20",
    ),
    (
        "[breathing]\ncurve = { sampled = [1.0, 1.0, 1.0] }",
        "breathing.curve.sampled",
        "range",
    ),
    (
        "[breathing]\ngates = { amplitude = 0 }",
        "breathing.gates.amplitude",
        "between 1 and 100",
    ),
    (
        "[output]\nwrite = ['sinogram']",
        "output.write",
        "projections",
    ),
    (
        "[output]\nwrite = ['truth', 'truth']",
        "output.write",
        "once",
    ),
    ("[output]\nvolumes = 'bitmap'", "output.volumes", "nrrd"),
    ("[output]\ngates = 'two'", "output.gates", "one-file"),
    (
        "[acquisition]\nmode = { gated = { gates = 2 } }\n[output]\ngates = 'one-file'\nvolumes = 'interfile-stir'",
        "output.volumes",
        "one file",
    ),
    (
        "[camera]\nrotation = 'continuous'\nseconds_per_view = 2.0\n[acquisition]\nmode = { gated = { gates = 2 } }\n[output]\ngates = 'one-file'",
        "output.gates",
        "different angles",
    ),
    ("[output]\nvalues = 'counts'", "output.values", "[noise]"),
    (
        "[output]\nmesh_tolerance = 1e-9",
        "output.mesh_tolerance",
        "between 0.00001 and 0.1",
    ),
    (
        "[reconstruction]\nregion = { x = [56, 200], y = [50, 200] }\n[output]\nvolumes = 'interfile-simind'",
        "output.volumes",
        "from + to = 256",
    ),
    (
        "[output]\nprojections = 'nifti'",
        "output.projections",
        "interfile-stir",
    ),
    (
        "[reconstruction]\ncompensation = 'all'",
        "reconstruction.compensation",
        "known-motion",
    ),
    (
        "[reconstruction]\ncompensation = 'known-motion'\n[breathing]\nrotation_degrees = [0.0, 3.0, 0.0]",
        "reconstruction.compensation",
        "rotation_degrees",
    ),
    (
        "[reconstruction]\ncompensation = 'known-motion'\nmethod = { osem = { subsets = 8, iterations = 4 } }\n[activity]\ncavity = { total = 3.0 }",
        "reconstruction.compensation",
        "concentration",
    ),
    (
        "[reconstruction]\nmethod = 'mlem'",
        "reconstruction.method",
        "`osem`",
    ),
    (
        "[reconstruction]\nmethod = 'osem'",
        "reconstruction.method",
        "subsets = 8",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 0, iterations = 4 } }",
        "reconstruction.method.osem.subsets",
        "between",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 91, iterations = 4 } }",
        "reconstruction.method.osem.subsets",
        "90",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 8, iterations = 0 } }",
        "reconstruction.method.osem.iterations",
        "between",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 8, iterations = 4, tolerance = 0.0 } }",
        "reconstruction.method.osem.tolerance",
        "between",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 8, iterations = 4, attenuation = true } }",
        "reconstruction.method.osem.attenuation",
        "[attenuation]",
    ),
    (
        "[reconstruction]\nmethod = { osem = { subsets = 8, iterations = 4, resolution = true } }",
        "reconstruction.method.osem.resolution",
        "[collimator]",
    ),
];

#[test]
fn every_field_rejects_a_bad_value_with_its_place() {
    let mut several = Vec::new();
    for (text, field, advice) in BAD {
        let error = error_of(text);
        let said = error.to_string();
        if error.findings.len() > 1 {
            several.push(format!("{text}\n{said}"));
        }
        assert_eq!(error.first().field, *field, "{text}\n{said}");
        assert!(said.contains(advice), "{text}\n{said}");
        // The line of the field, or of the table that lacks it.
        let [line, column] = error
            .first()
            .place
            .unwrap_or_else(|| panic!("{text}\n{said}"));
        let there = text.lines().nth(line - 1).unwrap_or_default();
        let named = field.split('.').any(|name| there.contains(name));
        assert!(named, "{text}\n{said}");
        assert!(column <= there.chars().count() + 1, "{said}");
    }
    // One mistake is one finding.
    assert!(several.is_empty(), "{}", several.join("\n\n"));
}

/// All findings together, in the order of the sections, each with its place; no rule compares a value that is itself a finding.
#[test]
fn a_scene_reports_all_of_its_findings() {
    let text = "[heart.inner]\nlength = -1.0\n[pose]\nrotate_x = 400.0\n[[defects]]\nlayers = [0.5, 0.5]\ns = [0.1, 0.6]\n\
        azimuths_degrees = [0.0, 90.0]\nactivity = 0.1\n[camera]\nviews = 0\nbins = 1\n[output]\nprojections = 'nifti'\n";
    let error = error_of(text);
    let found: Vec<_> = (error.findings.iter())
        .map(|finding| (finding.field.as_str(), finding.place.unwrap()[0]))
        .collect();
    let expected = [
        ("heart.inner.length", 2),
        ("pose.rotate_x", 4),
        ("defects.1.layers", 6),
        ("defects.1.s", 7),
        ("camera.views", 11),
        ("camera.bins", 12),
        ("output.projections", 14),
    ];
    assert_eq!(found, expected);
    assert_eq!(error.to_string().lines().count(), expected.len());
}

/// Paths of all values; for defects those of the first.
fn leaves_of(value: &toml::Value, path: &str, leaves: &mut Vec<String>) {
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                leaves_of(value, &format!("{path}.{name}"), leaves);
            }
        }
        toml::Value::Array(values) if values.iter().all(toml::Value::is_table) => {
            leaves_of(&values[0], &format!("{path}.1"), leaves);
        }
        _ => leaves.push(path.trim_start_matches('.').to_owned()),
    }
}

#[test]
fn every_field_is_in_the_written_scene_and_in_the_table_of_bad_values() {
    let scene = Scene::default();
    let page = scene.to_toml();
    let table: toml::Table = toml::from_str(&toml::to_string(&scene).unwrap()).unwrap();
    for (section, fields) in &table {
        for field in fields.as_table().unwrap().keys() {
            let name = format!("{section}.{field}");
            assert!(
                page.contains(&format!("\n{field} = ")) || page.contains(&format!("[{name}]")),
                "{name} is not written"
            );
            assert!(
                BAD.iter().any(|(_, bad, _)| bad.starts_with(&name)),
                "{name} has no bad value"
            );
        }
    }
    // Optional ones too, at any depth.
    let full = Scene::from_toml(FULL).unwrap();
    let mut leaves = Vec::new();
    leaves_of(&toml::Value::try_from(&full).unwrap(), "", &mut leaves);
    for leaf in &leaves {
        let is_bad = |(_, bad, _): &(&str, &str, &str)| leaf == bad;
        assert!(BAD.iter().any(is_bad), "{leaf} has no bad value");
    }
    for absent in ["centre", "pixels", "pixel", "region"] {
        assert!(page.contains(&format!("# {absent} = ")));
    }
}
