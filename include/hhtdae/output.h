/*
  Results of a run: named channels sampled at a fixed rate into HDF5 and CSV files, an animation for ParaView, a page
  that shows the run in a browser, the balance of energy and momentum. Results that are not requested cost nothing.

    scene.channel("tip.y", Measure::displacement(tip, 1), "m");
    scene.shape(arm, Shape::box({1, 0.05, 0.05}));
    scene.output().csv = "run.csv";
    scene.output().dt  = 0.01;

  The same from the command line; options override what the program has set:

    -scene_output <file.h5>       channels into HDF5: a dataset per channel with the attribute "units", and "time"
    -scene_csv <file.csv>         channels into a table whose first line is "time,name [unit],..."
    -scene_dt <dt>                time between samples; 0 (default): a sample at the end of every step
    -scene_rate <n>               samples per unit of time, in place of -scene_dt
    -scene_animation <prefix>     prefix.pvd, which ParaView opens, and prefix_000000.vtp, ...
    -scene_animation_dt <dt>      time between frames; 0: every step
    -scene_page <file.html>       one HTML file that any browser opens without a network: the run in three dimensions, with its channels
    -scene_page_frames <500>      number of frames from the start to the final time; a run without a final time has a frame at every step
    -scene_page_dt <dt>           time between frames; overrides -scene_page_frames
    -scene_page_nodes <6000>      largest number of nodes on the surfaces of all whole finite-element bodies together; more are thinned out
    -scene_balance [file]         energy and momentum at every step, into a file or printed; largest drift at the end

  For samples between the ends of steps, positions and velocities are interpolated by a cubic (TSHHT3Interpolate()). If a channel needs
  accelerations, reactions, variables or force states, the equations of motion are solved for them at the time of the sample
  (TSHHT3EvaluateAt()), at about the cost of a matrix and its factorization. Samples at the ends of steps cost nothing. They are the
  results of the step, of second order in h, but with several times the error of samples between; the last sample of a run may be of this
  kind even with -scene_dt. The first sample is the consistent start. Other types of TS are sampled at the ends of steps only.
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

/* What a body looks like in the animation and the page; position and axes are relative to the body's origin and axes */
struct Shape {
  enum Kind { Box, Cylinder, Sphere };
  Kind    kind     = Box;
  Vector3 size     = Vector3::Ones(); /* box: half edges; cylinder: radius, radius, half length along z; sphere: semi-axes of the ellipsoid */
  Vector3 position = Vector3::Zero();
  Matrix3 axes     = Matrix3::Identity();
  int     colour   = -1; /* in the page, 0xRRGGBB; negative: the page gives each body a different colour */

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
  Surface of a flexible body for the page, which shows it deformed and, where there are stress modes, coloured by stress. MakeSurface()
  in flexible.h makes it from a reduced body. Modes are those of the body's ModalBody, in the same order.
*/
struct Surface {
  std::vector<double> point;       /* 3 per node: undeformed, axes and origin of the FE model */
  std::vector<int>    triangle;    /* 3 nodes each, from 0, counter-clockwise seen from outside */
  Eigen::MatrixXf     shape;       /* 3 rows per node x modes: displacement per unit of each mode */
  Eigen::MatrixXf     stress;      /* 6 rows (xx, yy, zz, xy, yz, zx) per node x modes; empty: not known */
  std::string         stress_unit; /* label for the page, such as "Pa" */
};

struct OutputSettings {
  std::string file;             /* HDF5 file with the channels */
  std::string csv;              /* CSV table of the channels */
  double      dt = 0;           /* between samples; 0: the end of every step */
  std::string animation;        /* prefix of the animation's files */
  double      animation_dt = 0; /* between frames; 0: every step */
  std::string page;             /* HTML file */
  std::string page_title;       /* empty: the file's name */
  double      page_dt = 0;      /* between frames; 0: page_frames frames from the start to the final time, or every step if there is none */
  PetscInt    page_frames = 500;
  PetscInt    page_nodes  = 6000; /* largest number of surface nodes of all whole finite-element bodies together */
  bool        balance = false;  /* energy and momentum at every step */
  std::string balance_file;     /* empty: printed */
};

} // namespace hhtdae

#endif
