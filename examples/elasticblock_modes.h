/*
  The check of the elastic block: its first modes by inverse iteration, K phi = omega^2 M phi with Phi phi = 0. In each
  of them the motion decouples exactly, for any load and with Rayleigh damping: eta = phi^T M u obeys

    eta'' + (a + b omega^2) eta' + omega^2 eta = phi^T f,   eta(0) = eta'(0) = 0,

  whose solution is known in closed form. The multipliers do no work on a mode that satisfies the constraints.
*/
#ifndef HHTDAE_EXAMPLES_ELASTICBLOCK_MODES_H
#define HHTDAE_EXAMPLES_ELASTICBLOCK_MODES_H

#include "elasticblock_model.h"

namespace elasticblock
{

struct Mode {
  Vec    phi, M_phi;
  double omega, damping, load;   /* [rad/s], a + b omega^2 [1/s], phi^T f */
  double error = 0, largest = 0; /* over the run */
};

struct Modes {
  std::vector<Mode> mode; /* a rigid rotation about the hinge first, if there is one; then the first elastic mode */
  double            static_work = 0; /* f^T u of the clamped block at rest */
};

inline double exact(const Mode &m, double t)
{
  const double w2 = m.omega * m.omega, d = 0.5 * m.damping;
  if (w2 == 0) return d == 0 ? 0.5 * m.load * t * t : m.load * (2 * d * t - 1 + std::exp(-2 * d * t)) / (4 * d * d);
  const double s2 = w2 - d * d, s = std::sqrt(std::fabs(s2)), e = std::exp(-d * t);
  const double c = s2 > 0 ? std::cos(s * t) : std::cosh(s * t), si = s2 > 0 ? std::sin(s * t) : std::sinh(s * t);
  return m.load / w2 * (1 - e * (c + (s > 0 ? d * si / s : d * t)));
}

/* First elastic frequency of a slender beam (Euler-Bernoulli), clamped or hinged at one end; bending about y */
inline double beam_frequency(const Options &o)
{
  const double root = o.support == CLAMPED ? 1.875104 : 3.926602;
  const double I = o.size[1] * std::pow(o.size[2], 3) / 12, area = o.size[1] * o.size[2];
  return root * root * std::sqrt(o.steel.E * I / (o.steel.rho * area * std::pow(o.size[0], 4)));
}

/* Work of the load on the cantilever's own deflection, with shear (Timoshenko; Cowper's factor of a rectangle) */
inline double beam_static_work(const Options &o)
{
  const double L = o.size[0], area = o.size[1] * o.size[2], EI = o.steel.E * o.size[1] * std::pow(o.size[2], 3) / 12;
  const double nu = o.steel.nu, kGA = 10 * (1 + nu) / (12 + 11 * nu) * 0.5 * o.steel.E / (1 + nu) * area;
  if (o.load == TIP) return o.force * o.force * (L * L * L / (3 * EI) + L / kGA);
  const double w = o.steel.rho * area * o.gravity;
  return w * w * (std::pow(L, 5) / (20 * EI) + L * L * L / (3 * kGA));
}

/* [K + shift M, Phi^T; Phi 0] */
inline PetscErrorCode shifted_solver(const Model &m, double shift, KSP *ksp)
{
  PC        pc;
  PetscBool ordered;

  PetscFunctionBeginUser;
  PetscCall(MatCopy(m.S, m.J, SAME_NONZERO_PATTERN));
  PetscCall(MatAXPY(m.J, shift, m.M, SAME_NONZERO_PATTERN));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, "mode_"));
  PetscCall(KSPSetOperators(*ksp, m.J, m.J));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(MatGetFactorAvailable(m.J, "mumpsnd", MAT_FACTOR_CHOLESKY, &ordered));
  PetscCall(PCFactorSetMatSolverType(pc, ordered ? "mumpsnd" : MATSOLVERMUMPS));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscCall(KSPSetErrorIfNotConverged(*ksp, PETSC_TRUE));
  PetscFunctionReturn(0);
}

/*
  The start vector, the static deflection under the load, lies in the load's plane. Modes out of that plane may have lower frequencies:
  rounding introduces them and every iteration amplifies them. The iteration therefore ends when its changes begin to grow.
*/
constexpr double MODE_TOLERANCE = 1e-10, MODE_ACCEPTED = 1e-6;

/* Sets the multipliers in x to zero, M-orthogonalizes x to the known modes and scales it to x^T M x = 1; work = M x */
inline PetscErrorCode normalize(const Model &m, const std::vector<Mode> &known, Vec x, Vec work)
{
  PetscScalar c;

  PetscFunctionBeginUser;
  PetscCall(VecISSet(x, m.constraints, 0.0));
  for (const Mode &k : known) {
    PetscCall(VecDot(k.M_phi, x, &c));
    PetscCall(VecAXPY(x, -c, k.phi));
  }
  PetscCall(MatMult(m.M, x, work));
  PetscCall(VecDot(x, work, &c));
  PetscCheck(PetscRealPart(c) > 0, PETSC_COMM_WORLD, PETSC_ERR_USER,
             "The load does not move the block; use -force or -gravity");
  PetscCall(VecScale(x, 1 / PetscSqrtReal(PetscRealPart(c))));
  PetscCall(VecScale(work, 1 / PetscSqrtReal(PetscRealPart(c))));
  PetscFunctionReturn(0);
}

inline PetscErrorCode find_mode(const Model &m, KSP ksp, bool rigid, const std::vector<Mode> &known, Mode *mode)
{
  Vec         x;
  PetscReal   change = 2, before = 4;
  PetscScalar w2, load;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(m.f, &mode->phi));
  PetscCall(VecDuplicate(m.f, &mode->M_phi));
  PetscCall(VecDuplicate(m.f, &x));
  PetscCall(VecCopy(m.f, mode->M_phi));
  PetscCall(VecZeroEntries(mode->phi));
  for (int k = 0; k < 100 && change > MODE_TOLERANCE && change < before; ++k) {
    before = change;
    PetscCall(KSPSolve(ksp, mode->M_phi, x));
    PetscCall(normalize(m, known, x, mode->M_phi));
    PetscCall(VecAXPY(mode->phi, -1.0, x));
    PetscCall(MatMult(m.M, mode->phi, m.work));
    PetscCall(VecDot(mode->phi, m.work, &w2));
    change = PetscSqrtReal(PetscAbsScalar(w2));
    PetscCall(VecCopy(x, mode->phi));
  }
  PetscCheck(change < MODE_ACCEPTED, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED,
             "Inverse iteration stopped at a change of %g: the load excites no mode that stands apart from the others",
             (double)change);
  PetscCall(MatMult(m.S, mode->phi, x));
  PetscCall(VecDot(mode->phi, x, &w2));
  PetscCall(VecDot(mode->phi, m.f, &load));
  mode->omega   = rigid ? 0 : PetscSqrtReal(PetscMax(PetscRealPart(w2), 0.0));
  mode->damping = m.options.a + m.options.b * mode->omega * mode->omega;
  mode->load    = PetscRealPart(load);
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* K of the hinged block is singular, because it can rotate: its modes are sought near a shift */
inline PetscErrorCode modes_find(const Model &m, Modes *modes)
{
  const bool   hinged = m.options.support == HINGED;
  const double shift  = hinged ? std::pow(beam_frequency(m.options), 2) : 0;
  KSP          ksp;
  PetscScalar  work;

  PetscFunctionBeginUser;
  PetscCall(shifted_solver(m, shift, &ksp));
  if (!hinged) {
    PetscCall(KSPSolve(ksp, m.f, m.work));
    PetscCall(VecDot(m.work, m.f, &work));
    modes->static_work = PetscRealPart(work);
  }
  for (int k = 0; k < (hinged ? 2 : 1); ++k) {
    Mode mode;
    PetscCall(find_mode(m, ksp, hinged && k == 0, modes->mode, &mode));
    modes->mode.push_back(mode);
  }
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(0);
}

inline PetscErrorCode modes_monitor(TS, PetscInt, PetscReal t, Vec U, void *ctx)
{
  Modes *modes = (Modes *)ctx;

  PetscFunctionBeginUser;
  for (Mode &m : modes->mode) {
    PetscScalar eta;
    PetscCall(VecDot(m.M_phi, U, &eta));
    m.error   = std::fmax(m.error, std::fabs(PetscRealPart(eta) - exact(m, t)));
    m.largest = std::fmax(m.largest, std::fabs(exact(m, t)));
  }
  PetscFunctionReturn(0);
}

inline PetscErrorCode modes_destroy(Modes *modes)
{
  PetscFunctionBeginUser;
  for (Mode &m : modes->mode) {
    PetscCall(VecDestroy(&m.phi));
    PetscCall(VecDestroy(&m.M_phi));
  }
  modes->mode.clear();
  PetscFunctionReturn(0);
}

} // namespace elasticblock
#endif
