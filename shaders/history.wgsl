//! use eye
// Light that pixels keep from frame to frame, for surfaces that are diffuse and do not move: what temporal photon management keeps is
// what foveated paths, shadow rays and caustic photons brought to a pixel.
// Source: Shi et al. 2021, Algorithm 2, with sums in place of lists: a pixel owns its samples, hands them on to the pixel that shows
// their place in the next frame, and drops the oldest by letting all fade alike.
// Limits: one surface a pixel; the pixel that is nearest to where a place was takes it all.

/// Sums over samples as they are collected: smooth light and how many samples; light that is not filtered; albedos; and the guide.
//! split previous_smooth: vec4f, read, 1, 96
//! split previous_sharp: vec4f, read, 1, 112
//! split previous_albedo: vec4f, read, 1, 128
//! split previous_guide: vec4f, read, 1, 144
