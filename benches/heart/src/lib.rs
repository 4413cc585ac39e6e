//! Benches of membranes, solids, projectors and the phantom. They are apart from the package `benches`, so that a group of FBP compiles in two
//! minutes without them. Rows of diffsol and faer need the feature `rivals`, which takes minutes more.
