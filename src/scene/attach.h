/*
  Attachments of flexible bodies. A joint or force takes hold of a frame of its own, a body without mass, which six constraints hold
  at the point of the flexible body that follows its modes:

    x_i - x_e = 0,  axes of i parallel to those of e,   x_e = r + A (s + Psi_x eta),  R_e = A exp([Psi_theta eta])

  With geometric stiffening each of the six motions Psi eta loses (eta^T B eta)/2, B its own: a force or moment F along it then adds F B to the
  stiffness of the modes, as the derivative of its work. So joints, forces and contacts see a rigid body, and modes stay what one constraint kernel knows.
*/
#ifndef HHTDAE_SCENE_ATTACH_H
#define HHTDAE_SCENE_ATTACH_H

#include "scene_data.h"

namespace hhtdae
{

/* exp([phi]) and its left differential: the turn is [J dphi], dR = [J dphi] R; s = |phi|^2 */
struct SmallTurn {
  Vector3 phi;
  double  a, b, as, bs; /* J = 1 + a [phi] + b [phi]^2 and da/ds, db/ds */

  explicit SmallTurn(const Vector3 &phi);
  Matrix3 rotation() const { return Matrix3::Identity() + (1 - b * phi.squaredNorm()) * Cross<double>(phi) + a * square(); }
  Matrix3 J() const { return Matrix3::Identity() + a * Cross<double>(phi) + b * square(); }
  Matrix3 momentGradient(const Vector3 &n) const; /* d(J^T n)/dphi */

private:
  Matrix3 square() const { return phi * phi.transpose() - phi.squaredNorm() * Matrix3::Identity(); }
};

/* Six motions of the point in body axes, translation and rotation vector, and their derivatives by the modes */
struct AttachedPoint {
  Eigen::Matrix<double, 6, 1>              motion;
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_modes;

  AttachedPoint(const ModalAttachment &a, const Eigen::Ref<const Eigen::VectorXd> &eta);
};

class AttachStore : public StoreBase
{
public:
  struct Item {
    PetscInt element = -1, marker[2] = {-1, -1}; /* on the flexible body, on the frame */
  };
  std::vector<Item> all;

  PetscInt      size() const override { return (PetscInt)all.size(); }
  int           markers() const override { return 2; }
  PetscInt      marker(PetscInt e, int k) const override { return all[e].marker[k]; }
  PetscInt      element(PetscInt e) const override { return all[e].element; }
  bool          isConstraint() const override { return true; }
  bool          isHolonomic() const override { return true; }
  int           rows() const override { return 6; }
  unsigned char active(PetscInt) const override { return 0x3f; }
  bool          everIndependent() const override { return true; } /* each has a frame of its own */
  bool          carried(PetscInt) const override { return false; }
  bool          usesVelocities() const override { return false; }
  int           inputs() const override { return 0; }
  ScalarRef     input(PetscInt, int) const override { return {}; }
  void          localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override;
  void          describe(const SceneData &s, PetscInt e, double t, DescribedRows &rows) const override;
  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override;
};

} // namespace hhtdae

#endif
