/*
  Rows of a constraint at the described poses, for assembly and the redundancy check, before unknowns are numbered.
  Every rank has the whole description and computes the same values.
  Included by store.h.
*/
#ifndef HHTDAE_SCENE_DESCRIBED_ROWS_H
#define HHTDAE_SCENE_DESCRIBED_ROWS_H

#include "kernel.h"
#include <algorithm>

namespace hhtdae
{

struct DescribedRows {
  static constexpr int max_rows = 8, max_markers = 6;
  const char          *name   = "";
  bool                 length = true; /* true: rows are lengths, or velocities at velocity level; false: sines of angles, or angular velocities */
  double               value[max_rows] = {};          /* Phi; zero at velocity level */
  double               rate[max_rows]  = {};          /* Phi_t; at velocity level Psi with all velocities zero */
  Eigen::Matrix<double, max_rows, 6 * max_markers> J; /* Phi_q or Psi_q', columns (x, theta) of the markers */
  Eigen::MatrixXd modal; /* derivatives by the modal coordinates of the body of marker 0; empty if the rows do not depend on them */
};

/* Divides rows with units chosen by the user by the largest norm of their gradient at a marker. They become lengths, or
   angles if they depend only on rotations. */
template <int R, int M> void MakeLengths(DescribedRows &rows)
{
  for (int r = 0; r < R; r++) {
    double by_position = 0, by_rotation = 0;
    for (int k = 0; k < M; k++) {
      by_position = std::max(by_position, rows.J.block<1, 3>(r, 6 * k).norm());
      by_rotation = std::max(by_rotation, rows.J.block<1, 3>(r, 6 * k + 3).norm());
    }
    const double scale = by_position > 0 ? by_position : by_rotation;
    rows.length        = by_position > 0;
    if (!(scale > 0)) continue;
    rows.value[r] /= scale;
    rows.rate[r] /= scale;
    rows.J.row(r) /= scale;
  }
}

/* expressions.cpp: value of an input z at the start. States have their initial values. Variables are computed from
   states, time and the described motion (UserConstraint.StartVelocitiesByAVariable). Multipliers and force states are
   zero. */
double InitialInput(const SceneData &s, const ScalarRef &r, double t);

template <class K, class D> void DescribeRows(const SceneData &s, const D &d, double t, DescribedRows &rows)
{
  static_assert(K::rows <= DescribedRows::max_rows && K::markers <= DescribedRows::max_markers,
                "more rows or markers than described");
  constexpr int        M = K::markers, R = K::rows, Z = K::inputs;
  Frame<double>        f[M];
  typename K::Gradient J;
  rows.name   = K::name;
  rows.length = false;
  for (int k = 0; k < M; k++) {
    f[k] = s.frame(Marker{d.marker[k]});
    if (Depends(K::depends, 2 * k)) rows.length = true;
  }
  if constexpr (K::holonomic) {
    K::value(d.data, f, t, rows.value);
    K::time(d.data, f, t, rows.rate);
    K::gradient(d.data, f, t, J);
  } else {
    Twist<double>        w[M];
    double               z[Z > 0 ? Z : 1], zj[R * (Z > 0 ? Z : 1)];
    typename K::Gradient P;
    for (int k = 0; k < M; k++) w[k] = {Vec3<double>::Zero(), Vec3<double>::Zero()};
    for (int i = 0; i < Z; i++) z[i] = InitialInput(s, d.input[i], t);
    if constexpr (Z > 0)
      K::template value<double>(d.data, f, w, t, z, rows.rate);
    else
      K::template value<double>(d.data, f, w, t, rows.rate);
    K::gradient(d.data, f, w, t, z, J, P, zj);
    for (int r = 0; r < R; r++) rows.value[r] = 0;
  }
  rows.J.template topLeftCorner<R, 6 * M>() = J;
  if constexpr (K::own_units) MakeLengths<R, M>(rows);
}

} // namespace hhtdae

#endif
