/* Checks of mass, inertia, frequencies and invariants; see modal_check.h. */
#include "flexible/modal_check.h"
#include "scene/symmetric.h"
#include <set>

namespace hhtdae
{

namespace
{

/* Relative tolerance for rounding in symmetric matrices and their eigenvalues */
constexpr double symmetry_tolerance = 1e-9;
/* Tolerance of the M-orthonormality of modes, which come from an iterative eigensolver */
constexpr double orthonormality_tolerance = 1e-3;

bool Symmetric(const Eigen::MatrixXd &A) { return (A - A.transpose()).norm() <= symmetry_tolerance * A.norm(); }

std::string ImpossibleInvariants(const ModalBody &m)
{
  if (!m.modes() || !m.quadratic[0].size()) return "";
  for (std::size_t p = 0; p < 3; p++)
    if (!Symmetric(m.quadratic[p])) return "invariants quadratic in the modes that are not symmetric";
  const Eigen::MatrixXd sum = m.quadratic[0] + m.quadratic[1] + m.quadratic[2];
  if (!((sum - Eigen::MatrixXd::Identity(m.modes(), m.modes())).cwiseAbs().maxCoeff() < orthonormality_tolerance))
    return "modes that are not orthonormal in the mass matrix (xx + yy + zz of the invariants quadratic in them is not the "
           "identity)";
  return "";
}

} // namespace

std::string Impossible(const ModalBody &m)
{
  if (!(m.mass > 0)) return "a mass of " + std::to_string(m.mass) + ", which is not positive";
  for (Eigen::Index k = 0; k < m.omega.size(); k++)
    if (!(m.omega[k] > 0))
      return "a frequency that is not positive, of mode " + std::to_string(k) + " (rigid-body modes are left out)";
  if (!Symmetric(m.moments) || SymmetricEigen(m.moments).values[0] < -symmetry_tolerance * m.moments.norm())
    return "moments of inertia that no distribution of mass has (not symmetric, or with a negative eigenvalue)";
  std::set<std::string> names;
  for (const ModalAttachment &a : m.attachments)
    if (a.name.empty() || !names.insert(a.name).second)
      return a.name.empty() ? "an attachment without a name" : "two attachments of the name " + a.name;
  for (std::size_t k = 0; k < m.nodes.size(); k++) {
    if (m.nodes[k].label < 0 || (k && m.nodes[k].label <= m.nodes[k - 1].label)) return "kept nodes whose numbers are not ascending from 0 up";
    if (!m.nodes[k].turns && !m.nodes[k].rotation.isZero(0)) return "a rotation of kept node " + std::to_string(m.nodes[k].label) + ", which is said to have none";
  }
  names.clear();
  for (const ModalLoadCase &l : m.loads)
    if (l.name.empty() || !names.insert(l.name).second) return l.name.empty() ? "a load case without a name" : "two load cases of the name " + l.name;
  bool symmetric = true;
  for (const auto &B : m.stiffening) symmetric = symmetric && Symmetric(B);
  for (const ModalAttachment &a : m.attachments)
    for (const auto &B : a.stiffening) symmetric = symmetric && Symmetric(B);
  if (!symmetric) return "geometric stiffening that is not symmetric";
  return ImpossibleInvariants(m);
}

} // namespace hhtdae
