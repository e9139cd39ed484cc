/* Motion of markers for measures: values, and derivatives by the coordinates of their bodies. */
#ifndef HHTDAE_SCENE_MARKER_MOTION_H
#define HHTDAE_SCENE_MARKER_MOTION_H

#include "batch.h"
#include "kernels/marker_measure.h"

namespace hhtdae
{

constexpr int measured_coordinates = 3 * max_coordinates; /* of the bodies of i, j and frame */
using MeasureDual                  = Dual<measured_coordinates>;

/* accelerations: whether to compute them; else they are zero */
MarkerMotion<double> MotionOfMarker(const Evaluation &e, PetscInt marker, bool accelerations);

/* Derivative directions first + c: coordinate c with its rate and acceleration, du = 1, du' = sv, du'' = sa. For frames of attachments only the derivative by their position (order 0),
   velocity (1) or acceleration (2); other bodies have derivatives in order 0 only. */
MarkerMotion<MeasureDual> MotionOfMarker(const Evaluation &e, PetscInt marker, int first, int order);

} // namespace hhtdae

#endif
