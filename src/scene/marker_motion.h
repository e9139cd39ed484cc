/* Motion of markers as measures ask for it: values, and with derivatives by the coordinates of their bodies. */
#ifndef HHTDAE_SCENE_MARKER_MOTION_H
#define HHTDAE_SCENE_MARKER_MOTION_H

#include "batch.h"
#include "kernels/marker_measure.h"

namespace hhtdae
{

constexpr int measured_coordinates = 3 * max_coordinates; /* of the bodies of i, j and frame */
using MeasureDual                  = Dual<measured_coordinates>;

/* Accelerations are zero unless asked for. */
MarkerMotion<double> MotionOfMarker(const Evaluation &e, PetscInt marker, bool accelerations);

/* Directions first..: coordinate c with its rate and acceleration, as du = 1, du' = sv, du'' = sa. Frames of attachments take one order at a time, and the
   coordinates of other bodies belong to the first. */
MarkerMotion<MeasureDual> MotionOfMarker(const Evaluation &e, PetscInt marker, int first, int order);

} // namespace hhtdae

#endif
