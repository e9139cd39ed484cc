/* Data of a linearization: computed by linearize.cpp, solved by minimal.cpp (with row_rates.cpp) and response.cpp, evaluated by small_motion.cpp and steadiness.cpp. */
#ifndef HHTDAE_SCENE_LINEARIZATION_H
#define HHTDAE_SCENE_LINEARIZATION_H

#include "hhtdae/linearize.h"
#include "snapshot.h"
#include <array>

namespace hhtdae
{

/* x, x', x'' of own unknowns */
using SmallMotion = std::array<std::vector<double>, 3>;

/* Rows of constraints of C and K, and M with all of its rows; columns: all unknowns */
struct RowValues {
  Eigen::MatrixXd C, K, M;
};

/* Their first time derivatives along the motion that is linearized, and the second ones of K and M */
struct RowRates : RowValues {
  Eigen::MatrixXd second_K, second_M;

  void setZero(Eigen::Index rows, Eigen::Index columns)
  {
    for (Eigen::MatrixXd *x : {&C, &K, &second_K}) *x = Eigen::MatrixXd::Zero(rows, columns);
    for (Eigen::MatrixXd *x : {&M, &second_M}) *x = Eigen::MatrixXd::Zero(columns, columns);
  }
};

/* Largest difference of spins, relative to the fastest, for which flexible bodies count as turning alike; largest spin, relative to the lowest
   frequency of a flexible body, that does not affect its modes (SmallBodies.AxesOfSeveralBodies) */
constexpr double same_spin_tolerance = 1e-2, slow_spin_ratio = 1e-4;

struct Linearization::Work {
  TS                         start = nullptr; /* for a run that has not begun: a copy, BeginCopy(), that provides accelerations and multipliers */
  Runtime                   *R = nullptr;
  double                     t = 0, size = 1;                                     /* t: time of the state; size: size of the scene */
  /* angular velocity and acceleration of the axes in which displacements and rotations are given */
  Vector3                    spin = Vector3::Zero(), spin_rate = Vector3::Zero();
  Matrix3                    axes = Matrix3::Identity(); /* orientation of these axes in space */
  Vec                        state[3] = {};   /* u, u', u'' */
  mutable Origin             origin;          /* reference attitudes and memories that belong to `state` */
  Mat                        M = nullptr, C = nullptr, K = nullptr;
  Mat                        turn[3][3] = {}; /* T_kl of linearize.cpp, l <= k */
  std::vector<unsigned char> role;         /* of own unknowns */
  std::vector<double>        unit;         /* units of own unknowns: 1/sqrt(mass) for coordinates, so that masses become 1; 1 for others */
  mutable Snapshot           perturbed;

  ~Work() { clear(); }
  void     clear();
  MPI_Comm comm() const { return R->scene.comm; }
  bool     coordinate(PetscInt i) const { return role[i] == TSHHT3_COORDINATE; }

  PetscErrorCode check(const char *call) const;
  PetscErrorCode check(const char *call, const Mode &m) const; /* collective */
  PetscErrorCode chooseAxes(Body of);
  PetscErrorCode differentiate();
  PetscErrorCode chooseUnits();
  PetscErrorCode derivative(const Measure &m, const SmallMotion &along, double largest, double *x) const; /* derivative of a measure along a small motion */
  PetscErrorCode displacement(const std::vector<std::complex<double>> &x, double *largest) const;         /* largest entry of coordinates on all ranks */
  PetscErrorCode load(const Excitation &in, std::vector<double> *b) const;                                /* right-hand side of an excitation, own rows */
  PetscErrorCode motionLoad(Element e, std::vector<double> *b) const;
  PetscErrorCode pointLoad(const Excitation &in, std::vector<double> *b) const;
  PetscErrorCode groundLoad(const Vector3 &ground, std::vector<double> *b) const;
  PetscErrorCode toState(const SmallMotion &x, Vec d[3]) const;
  /* Rates of the given rows of constraints, after elimination of the given variables, which these rows read, and of M; rows and variables are
     global numbers. Zero if there are no constraints. */
  PetscErrorCode rates(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode ratesInTime(double e, bool at_rest, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode ratesBy(double e, bool of_time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const;
  PetscErrorCode rowsAt(double later, double time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowValues *out) const;
  PetscErrorCode characteristicRate(double *rate) const;
  PetscErrorCode setState(Vec at[3]) const; /* sets the snapshot `perturbed` to the state `at`, which is near `state` */
  PetscErrorCode linearizeAt(double later, double time, Work *w) const;
};

/* Eliminates variables from the given rows of C and K by means of the variables' own rows; NaN if the latter are singular */
void EliminateVariables(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, Eigen::MatrixXd &C, Eigen::MatrixXd &K);

/* Copies a distributed matrix to a dense one on every rank */
PetscErrorCode GatherDense(Mat A, Eigen::MatrixXd &out);

/* The amplitude of a measure in the motion Re(x exp(s t)) */
PetscErrorCode AmplitudeOf(const Linearization::Work &w, const Measure &m, const std::vector<std::complex<double>> &x, std::complex<double> s, std::complex<double> *y);

} // namespace hhtdae

#endif
