/*
  Results of a run: named channels sampled at a fixed rate into HDF5 and CSV files, an animation for ParaView, a page
  that shows the run in a browser, the balance of energy and momentum. What is not asked for costs nothing.

    scene.channel("tip.y", Measure::displacement(tip, 1), "m");
    scene.shape(arm, Shape::box({1, 0.05, 0.05}));
    scene.output().csv = "run.csv";
    scene.output().dt  = 0.01;

  The same from the command line; options win over what the program has set:

    -scene_output <file.h5>       channels into HDF5: a dataset per channel with the attribute "units", and "time"
    -scene_csv <file.csv>         channels into a table, its first line "time,name [unit],..."
    -scene_dt <dt>                time between samples; 0, the default: the end of every step
    -scene_rate <n>               the same as samples per unit of time
    -scene_animation <prefix>     prefix.pvd, which ParaView opens, and prefix_000000.vtp, ...
    -scene_animation_dt <dt>      time between frames; 0: every step
    -scene_page <file.html>       one HTML file that any browser opens without a network: the run in three dimensions, with its channels
    -scene_page_frames <500>      frames from the start to the final time; every step where the run has no final time
    -scene_page_dt <dt>           time between frames, which wins over their number
    -scene_page_nodes <6000>      nodes of all surfaces of whole finite-element bodies, which are thinned to so many
    -scene_balance [file]         energy and momentum at every step, into a file or printed; largest drift at the end

  Samples between the ends of steps: positions and velocities are cubic in the step, TSHHT3Interpolate(). Where a channel needs
  accelerations, reactions, variables or force states, the equations of motion are solved for them at the time of the sample,
  TSHHT3EvaluateAt(), at about the cost of a matrix and its factorization. Samples at the ends of steps cost nothing and are what the step has found, to
  second order in h, but with several times the error of those between; with a grid the last sample of a run may be such a one. The first sample is the
  consistent start. Other types of TS are sampled at the ends of steps.
*/
#ifndef HHTDAE_OUTPUT_H
#define HHTDAE_OUTPUT_H

#include "hhtdae/types.h"
#include <string>
#include <vector>

namespace hhtdae
{

struct Channel {
  PetscInt id = -1;
};

/* What a body looks like in the animation and the page; placed by position and axes in body axes, from the body's origin */
struct Shape {
  enum Kind { Box, Cylinder, Sphere };
  Kind    kind     = Box;
  Vector3 size     = Vector3::Ones(); /* half edges; radius, radius, half length along z; radii: a sphere may be an ellipsoid */
  Vector3 position = Vector3::Zero();
  Matrix3 axes     = Matrix3::Identity();
  int     colour   = -1; /* in the page, 0xRRGGBB; negative: one of its own for each body */

  static Shape box(const Vector3 &half, const Vector3 &position = Vector3::Zero(), const Matrix3 &axes = Matrix3::Identity())
  {
    return {Box, half, position, axes};
  }
  static Shape cylinder(double radius, double length, const Vector3 &position = Vector3::Zero(), const Matrix3 &axes = Matrix3::Identity())
  {
    return {Cylinder, {radius, radius, 0.5 * length}, position, axes};
  }
  static Shape sphere(double radius, const Vector3 &position = Vector3::Zero())
  {
    return {Sphere, {radius, radius, radius}, position, Matrix3::Identity()};
  }
  Shape coloured(int rgb) const
  {
    Shape s  = *this;
    s.colour = rgb;
    return s;
  }
};

/*
  Surface of a flexible body for the page, which shows it deformed, and coloured by stress where there are stress modes. MakeSurface() in flexible.h
  makes it from a reduced body. Modes are those of the body's ModalBody, in their order.
*/
struct Surface {
  std::vector<double> point;       /* 3 per node: undeformed, axes and origin of the FE model */
  std::vector<int>    triangle;    /* 3 nodes each, from 0, counter-clockwise seen from outside */
  Eigen::MatrixXf     shape;       /* 3 rows per node x modes: displacement per unit of each mode */
  Eigen::MatrixXf     stress;      /* 6 rows per node x modes, xx, yy, zz, xy, yz, zx; empty: not known */
  std::string         stress_unit; /* "Pa"; a label */
};

struct OutputSettings {
  std::string file;             /* HDF5, channels */
  std::string csv;              /* table of channels */
  double      dt = 0;           /* between samples; 0: the end of every step */
  std::string animation;        /* prefix of its files */
  double      animation_dt = 0; /* between frames; 0: every step */
  std::string page;             /* HTML file */
  std::string page_title;       /* empty: the file's name */
  double      page_dt = 0;      /* between its frames; 0: page_frames of them from the start to the final time, or every step if there is none */
  PetscInt    page_frames = 500;
  PetscInt    page_nodes  = 6000; /* of all surfaces of whole finite-element bodies */
  bool        balance = false;  /* of energy and momentum, at every step */
  std::string balance_file;     /* empty: printed */
};

} // namespace hhtdae

#endif
