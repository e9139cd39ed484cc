/* The scales of a body: mass, extent, rigid motions, stiffness; and the checks of supports and units based on them. */
#include "diagnose.h"
#include "modes.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

/* ---- sizes ---- */

/* Mass, centre of mass and second moments, from M times ones and M times the coordinates */
static PetscErrorCode MassMoments(const FeModel &model, BodyScales *s)
{
  MatrixXd X(3 * model.own, 2), MX;
  double   sums[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 3 * model.own; i++) X.row(i) << 1., model.coordinates[i];
  PetscCall(Multiply(model.M, X, &MX));
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    sums[i % 3] += MX(i, 1);
    sums[3] += MX(i, 0) / 3;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, model.comm));
  s->mass = sums[3];
  PetscCheck(s->mass > 0, model.comm, PETSC_ERR_ARG_WRONG, "The FE model has the mass %g: M is not positive", s->mass);
  s->center = Vector3(sums[0], sums[1], sums[2]) / s->mass;
  for (PetscInt i = 0; i < 3 * model.own; i++) X(i, 1) -= s->center[i % 3];
  PetscCall(Multiply(model.M, X, &MX));
  s->moments.setZero();
  for (PetscInt i = 0; i < model.own; i++) s->moments += X.block<3, 1>(3 * i, 1) * MX.block<3, 1>(3 * i, 1).transpose();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, s->moments.data(), 9, MPI_DOUBLE, MPI_SUM, model.comm));
  s->moments = 0.5 * (s->moments + s->moments.transpose()).eval();
  PetscFunctionReturn(0);
}

static PetscErrorCode Extents(const FeModel &model, BodyScales *s)
{
  double       ends[7];
  Vec          k, m;
  PetscScalar *kk, *mm;

  PetscFunctionBegin;
  std::fill(ends, ends + 7, -PETSC_MAX_REAL);
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    ends[i % 3]     = std::max(ends[i % 3], model.coordinates[i]);
    ends[3 + i % 3] = std::max(ends[3 + i % 3], -model.coordinates[i]);
  }
  PetscCall(MatCreateVecs(model.K, &k, &m));
  PetscCall(MatGetDiagonal(model.K, k));
  PetscCall(MatGetDiagonal(model.M, m));
  PetscCall(VecGetArray(k, &kk));
  PetscCall(VecGetArray(m, &mm));
  for (PetscInt i = 0; i < 3 * model.own; i++) ends[6] = std::max(ends[6], kk[i] / mm[i]);
  PetscCall(VecRestoreArray(k, &kk));
  PetscCall(VecRestoreArray(m, &mm));
  PetscCall(VecDestroy(&k));
  PetscCall(VecDestroy(&m));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 7, MPI_DOUBLE, MPI_MAX, model.comm));
  s->volume = 1;
  s->length = 0;
  for (int c = 0; c < 3; c++) {
    s->volume *= ends[c] + ends[3 + c];
    s->length = std::max(s->length, std::max(ends[c] - s->center[c], ends[3 + c] + s->center[c]));
  }
  s->stiff = ends[6];
  PetscFunctionReturn(0);
}

static PetscErrorCode RigidBasis(const FeModel &model, BodyScales *s)
{
  const SymmetricEigen principal(s->moments.trace() * Matrix3::Identity() - s->moments);

  PetscFunctionBegin;
  PetscCheck(principal.values[0] > 1e-10 * principal.values[2], model.comm, PETSC_ERR_ARG_WRONG,
             "All mass of the FE model is on one line, its least moment of inertia is %g; it needs an extent across",
             principal.values[0]);
  s->frame.setZero();
  s->frame.topLeftCorner<3, 3>() = Matrix3::Identity() / std::sqrt(s->mass);
  for (int k = 0; k < 3; k++)
    s->frame.block<3, 1>(3, 3 + k) = principal.vectors.col(k) / std::sqrt(principal.values[k]);
  s->rigid.resize(3 * model.own, 6);
  for (PetscInt i = 0; i < model.own; i++)
    s->rigid.middleRows(3 * i, 3) = RigidMotion(NodePosition(model, i), s->center) * s->frame;
  PetscFunctionReturn(0);
}

/* Lowest elastic Ritz value for displacements that are quadratic in the coordinates */
static PetscErrorCode QuadraticRitz(const FeModel &model, BodyScales *s)
{
  MatrixXd X = MatrixXd::Zero(3 * model.own, 24), Y, K, M;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model.own; i++) {
    const Vector3 x        = (NodePosition(model, i) - s->center) / s->length;
    const double  field[9] = {x[0],        x[1],        x[2],        x[0] * x[0], x[1] * x[1],
                              x[2] * x[2], x[0] * x[1], x[1] * x[2], x[2] * x[0]};
    int           col      = 0;
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 9; k++)
        if (k > 2 || k <= c) X(3 * i + c, col++) = field[k]; /* linear fields without rotations: one of each symmetric pair */
  }
  /* M-orthogonalize to the rigid motions */
  MatrixXd part;
  PetscCall(Multiply(model.M, s->rigid, &Y));
  part = Y.transpose() * X;
  PetscCall(SumOverRanks(model.comm, &part));
  X -= s->rigid * part;
  PetscCall(Multiply(model.K, X, &Y));
  K = X.transpose() * Y;
  PetscCall(Multiply(model.M, X, &Y));
  M = X.transpose() * Y;
  PetscCall(SumOverRanks(model.comm, &K));
  PetscCall(SumOverRanks(model.comm, &M));
  /* with the two integration points across one layer of reduced elements squares are constant, so that the remaining field has no mass (Calculix.OneReducedElementAcross) */
  const VectorXd       scale = M.diagonal().cwiseMax(1e-8 * s->mass).cwiseSqrt().cwiseInverse();
  const MatrixXd       Ms    = scale.asDiagonal() * M * scale.asDiagonal();
  const SymmetricEigen mass(0.5 * (Ms + Ms.transpose()));
  PetscInt             from = 0; /* skips combinations of fields that vanish at few or coplanar nodes */
  while (from < 23 && mass.values[from] < 1e-8) from++;
  const PetscInt n = 24 - from;
  const MatrixXd W = scale.asDiagonal() * mass.vectors.rightCols(n) *
                     mass.values.tail(n).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatrixXd       Kw = W.transpose() * K * W;
  const SymmetricEigen ritz(0.5 * (Kw + Kw.transpose()));
  s->soft = ritz.values[n - 1];
  for (PetscInt k = n; k-- > 0;) /* the least Ritz value that is not zero, as that of a mechanism */
    if (ritz.values[k] > 1e-9 * ritz.values[n - 1]) s->soft = ritz.values[k];
  PetscFunctionReturn(0);
}

PetscErrorCode ComputeScales(const FeModel &model, BodyScales *scales)
{
  PetscFunctionBegin;
  PetscCall(MassMoments(model, scales));
  PetscCall(Extents(model, scales));
  PetscCall(RigidBasis(model, scales));
  PetscCall(QuadraticRitz(model, scales));
  PetscCheck(scales->soft > 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The FE model has no elastic stiffness: K vanishes for quadratic displacements");
  PetscFunctionReturn(0);
}

/* ---- supports ---- */

PetscErrorCode CheckUnsupported(const FeModel &model, const BodyScales &s)
{
  static const char *const motion[6] = {"translation along x",
                                        "translation along y",
                                        "translation along z",
                                        "rotation about its axis of least inertia",
                                        "rotation about its axis of middle inertia",
                                        "rotation about its axis of greatest inertia"};
  MatrixXd                 Kr;
  VectorXd                 energy(6);

  PetscFunctionBegin;
  PetscCall(Multiply(model.K, s.rigid, &Kr));
  for (int k = 0; k < 6; k++) energy[k] = model.own ? s.rigid.col(k).dot(Kr.col(k)) : 0.;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy.data(), 6, MPI_DOUBLE, MPI_SUM, model.comm));
  for (int k = 0; k < 6; k++) {
    /* coordinates may have fewer digits than K, so that a rotation strains elements a little */
    const double allowed = k < 3 ? 1e-6 * s.soft + 1e-14 * s.stiff : 1e-4 * s.soft + 1e-13 * s.stiff;
    if (std::abs(energy[k]) <= allowed) continue;
    std::string labels;
    PetscCall(MostMoved(model, Kr.col(k), &labels));
    SETERRQ(model.comm, PETSC_ERR_ARG_WRONG,
            "K is not free of supports: a rigid %s (of modal mass 1) meets the stiffness %g, elastic modes begin at %g "
            "or lower. The forces act most at node(s) %s: "
            "take supports and springs to ground out of the FE model, or correct the coordinates, their units or the "
            "order of unknowns",
            motion[k], energy[k], s.soft, labels.c_str());
  }
  PetscFunctionReturn(0);
}

/* ---- units ---- */

std::string SuspectUnits(const FeModel &model, const BodyScales &s)
{
  char text[512];
  /* sqrt(K_ii / M_ii) times the distance of nodes is about the speed of elastic waves, some 1000 m/s in solids, in m/s, mm/s or in/s */
  const double distance  = std::cbrt(std::max(s.volume, 1e-9 * s.length * s.length * s.length) / (double)model.nodes);
  const double speed     = distance * std::sqrt(s.stiff) / 6; /* factor for bricks, nearly right for tetrahedra */
  const double frequency = std::sqrt(s.soft) / (2 * PETSC_PI);
  if (speed > 10 && speed < 5e7) return "";
  snprintf(text, sizeof text,
           "units suspect: waves would run through the body at about %.1e units of length per unit of time (some 1e3 "
           "m/s are usual), the first "
           "elastic frequency is below %.1e; mass %.4g, extent %.3g. Young's modulus in N/m^2 goes with m, kg, s; in "
           "N/mm^2 with mm, tonne, s",
           speed, frequency, s.mass, s.length);
  return text;
}

} // namespace hhtdae
