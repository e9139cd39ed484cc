/*
  A flexible body in modal coordinates, the input of a scene: plain data, made by the flexible-body library (flexible.h) from a
  finite-element model, read from a file of reduced bodies, or filled in by the user.

  The displacement field from the undeformed body is sum_k phi_k(X) eta_k in the axes of the floating frame, whose origin is the undeformed
  centre of mass. Modes are orthonormal in the mass matrix and diagonalize the stiffness; rigid-body modes are left out. The equations of
  motion need only the integrals below, the inertia invariants of the body (Shabana, Dynamics of Multibody Systems, ch. 5; dm is the mass
  element, X the undeformed position from the centre of mass).
*/
#ifndef HHTDAE_MODAL_H
#define HHTDAE_MODAL_H

#include "hhtdae/types.h"
#include <array>
#include <string>
#include <vector>

namespace hhtdae
{

/* A place where joints and forces act; its translation and rotation follow from the modes */
struct ModalAttachment {
  std::string                               name;
  Vector3                                   position = Vector3::Zero(); /* undeformed, axes and origin of the FE model */
  Eigen::Matrix<double, 3, Eigen::Dynamic>  translation, rotation;      /* 3 x modes: of the point, per unit of each mode */
  /* Geometric stiffness by a unit force along the body axes x, y, z and a unit moment about them: symmetric, modes x modes; empty: not known.
     To second order the point moves by translation eta - (eta^T stiffening eta)/2. */
  std::array<Eigen::MatrixXd, 6> stiffening;
};

/* A node of the FE model that the reduction has kept: an attachment without geometric stiffening. It rotates with the nodes that it shares
   elements with; if these do not determine a rotation, `rotation` is zero and the node can take forces only. */
struct ModalNode : ModalAttachment {
  PetscInt label = 0;    /* number of the node in the FE model */
  bool     turns = true; /* the rotation is determined */
};

/*
  Nodal forces f of a load case, reduced to their resultant force, their moment about the undeformed centre of mass and the modal forces, in
  body axes and to first order in the modal coordinates,

    force + force_gradient eta,   moment + moment_gradient eta,   modal + modal_gradient eta

  Forces that are constant in body axes have only moment_gradient = sum phi x f; a pressure that remains normal to the surface has all three
  gradients.
*/
struct ModalLoadCase {
  std::string     name;
  Vector3         force = Vector3::Zero(), moment = Vector3::Zero();
  Eigen::VectorXd modal; /* sum phi^T f */
  Eigen::Matrix<double, 3, Eigen::Dynamic> moment_gradient; /* 3 x modes */
  Eigen::Matrix<double, 3, Eigen::Dynamic> force_gradient;  /* 3 x modes; empty: zero */
  Eigen::MatrixXd                          modal_gradient;  /* modes x modes; empty: zero */
};

struct ModalBody {
  std::string name;
  double      mass    = 0;
  Vector3     center  = Vector3::Zero(); /* of mass, undeformed, axes and origin of the FE model */
  Matrix3     moments = Matrix3::Zero(); /* int X X^T dm */

  Eigen::VectorXd omega; /* circular frequencies of the modes, rad per unit of time */

  Eigen::Matrix<double, 3, Eigen::Dynamic> first;                  /* int phi dm: 3 x modes */
  std::array<Eigen::Matrix<double, 3, Eigen::Dynamic>, 3> moment;  /* moment[c](d, k) = int X_c phi_k,d dm */
  /* quadratic[p](k, l) = int phi_k,c phi_l,d dm for (c, d) = xx, yy, zz, xy, yz, zx; empty: not known, the mass matrix can then only be
     Partial or Constant. The sum of the first three is the identity. */
  std::array<Eigen::MatrixXd, 6> quadratic;

  /* Geometric stiffness by the angular velocity w: w_c w_d stiffening[p] for (c, d) = xx, yy, zz, and twice this for xy, yz, zx; not used with
     ModalMass::Constant */
  std::array<Eigen::MatrixXd, 6> stiffening;

  std::vector<ModalAttachment> attachments;
  std::vector<ModalNode>       nodes; /* by increasing label */
  std::vector<ModalLoadCase>   loads;

  PetscInt modes() const { return (PetscInt)omega.size(); }
  Matrix3  inertia() const { return moments.trace() * Matrix3::Identity() - moments; } /* undeformed, about the centre of mass */
  PetscInt attachment(const std::string &called) const                                 /* index of the attachment; -1: there is none */
  {
    for (std::size_t i = 0; i < attachments.size(); i++)
      if (attachments[i].name == called) return (PetscInt)i;
    return -1;
  }
  PetscInt node(PetscInt label) const /* likewise */
  {
    for (std::size_t i = 0; i < nodes.size(); i++)
      if (nodes[i].label == label) return (PetscInt)i;
    return -1;
  }
  PetscInt load(const std::string &load) const
  {
    for (std::size_t i = 0; i < loads.size(); i++)
      if (loads[i].name == load) return (PetscInt)i;
    return -1;
  }
};

/* How the mass matrix depends on the deformation (the choices of Adams/Flex, under the same names) */
enum class ModalMass {
  Full,    /* all invariants */
  Partial, /* without the invariants that are quadratic in the modes */
  Constant /* mass matrix of the undeformed body */
};

} // namespace hhtdae

#endif
