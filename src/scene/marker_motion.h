/* Motion of markers for measures: values, and derivatives by the coordinates of their bodies. */
#ifndef HHTDAE_SCENE_MARKER_MOTION_H
#define HHTDAE_SCENE_MARKER_MOTION_H

#include "batch.h"
#include "kernels/marker_measure.h"

namespace hhtdae
{

constexpr int measured_coordinates = 3 * max_coordinates; /* largest number of coordinates of the bodies of i, j and frame together */
using MeasureDual                  = Dual<measured_coordinates>;

/* The motion of a local marker; its accelerations are zero unless `accelerations` is set */
MarkerMotion<double> MotionOfMarker(const Evaluation &e, PetscInt marker, bool accelerations);

/* The motion with derivatives. Direction first + c perturbs coordinate c of the body together with its velocity and
   acceleration, du = 1, du' = sv, du'' = sa. Markers on attachments' frames have derivatives by the frame's position
   (order 0), velocity (1) or acceleration (2) instead, one order per call; other markers have derivatives for order 0
   only. */
MarkerMotion<MeasureDual> MotionOfMarker(const Evaluation &e, PetscInt marker, int first, int order);

} // namespace hhtdae

#endif
