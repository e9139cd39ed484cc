/* What the parts of a linearization share: linearize.cpp makes it, minimal.cpp, with row_rates.cpp, and response.cpp solve it, small_motion.cpp reads what they find. */
#ifndef HHTDAE_SCENE_LINEARIZATION_H
#define HHTDAE_SCENE_LINEARIZATION_H

#include "hhtdae/linearize.h"
#include "snapshot.h"
#include <array>

namespace hhtdae
{

/* x, x', x'' of own unknowns */
using SmallMotion = std::array<std::vector<double>, 3>;

/* Rates of rows of C and K along the motion that is linearized, by all unknowns; second: of the rates */
struct RowRates {
  Eigen::MatrixXd C, K, second_K;
};

struct Linearization::Work {
  TS                         start = nullptr;   /* of a run that has not begun: one that has made the first step in its place */
  Runtime                   *R = nullptr;
  double                     t = 0, size = 1; /* of the scene */
  Vector3                    spin = Vector3::Zero(), spin_rate = Vector3::Zero(); /* of the axes of displacements and rotations */
  Matrix3                    axes = Matrix3::Identity(); /* these axes in space */
  Vec                        state[3] = {};   /* u, u', u'' */
  mutable Origin             origin;          /* what these count from; the run may have gone on */
  Mat                        M = nullptr, C = nullptr, K = nullptr;
  Mat                        turn[3][3] = {}; /* T_kl of linearize.cpp, l <= k */
  std::vector<unsigned char> role;         /* of own unknowns */
  std::vector<double>        unit;         /* of own unknowns: amounts of coordinates that have the kinetic energy of a mass of 1 at a speed of 1; else 1 */
  mutable Snapshot           moved;

  ~Work() { clear(); }
  void     clear();
  MPI_Comm comm() const { return R->scene.comm; }
  bool     coordinate(PetscInt i) const { return role[i] == TSHHT3_COORDINATE; }

  PetscErrorCode check(const char *call) const;
  PetscErrorCode check(const char *call, const Mode &m) const; /* collective */
  PetscErrorCode chooseAxes(Body of);
  PetscErrorCode differentiate();
  PetscErrorCode chooseUnits();
  PetscErrorCode derivative(const Measure &m, const SmallMotion &along, double largest, double *x) const; /* how a measure changes */
  PetscErrorCode displacement(const std::vector<std::complex<double>> &x, double *largest) const; /* the largest one */
  PetscErrorCode load(const Excitation &in, std::vector<double> *b) const;                /* the right-hand side, own rows */
  PetscErrorCode drive(Element e, std::vector<double> *b) const;
  PetscErrorCode push(const Excitation &in, std::vector<double> *b) const;
  PetscErrorCode shake(const Vector3 &ground, std::vector<double> *b) const;
  PetscErrorCode toState(const SmallMotion &x, Vec d[3]) const;
  /* of these rows of constraints, less the variables that they read; global numbers */
  PetscErrorCode rates(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode ratesInTime(double e, bool still, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode ratesBy(double e, bool of_time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode rowsAt(double later, double time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, Eigen::MatrixXd *of_C, Eigen::MatrixXd *of_K) const;
  PetscErrorCode fastest(double *rate) const;
  PetscErrorCode look(Vec at[3]) const; /* `moved` at this state, near `state` */
  PetscErrorCode nearby(double later, double time, Work *w) const;
};

/* Rows less what they read of variables, which are eliminated by their own rows; not a number where these are singular */
void EliminateVariables(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, Eigen::MatrixXd &C, Eigen::MatrixXd &K);

/* All of a distributed matrix on every rank */
PetscErrorCode Whole(Mat A, Eigen::MatrixXd &out);

/* The amplitude of a measure in the motion Re(x exp(s t)) */
PetscErrorCode AmplitudeOf(const Linearization::Work &w, const Measure &m, const std::vector<std::complex<double>> &x, std::complex<double> s, std::complex<double> *y);

} // namespace hhtdae

#endif
