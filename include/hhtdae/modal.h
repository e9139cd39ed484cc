/*
  A flexible body in modal coordinates, as a scene takes it: plain data, made by the flexible-body library (flexible.h) from a
  finite-element model, read from a file of reduced bodies, or filled in by the user.

  The field of displacement from the undeformed body is sum_k phi_k(X) eta_k in the axes of the floating frame, whose origin is the
  undeformed centre of mass. Modes are orthonormal in the mass matrix and diagonalize the stiffness; rigid-body modes are left out.
  What the equations of motion need of mass distribution and modes are the integrals below, the inertia invariants of the body
  (Shabana, Dynamics of Multibody Systems, ch. 5; dm is the measure of mass, X the undeformed position from the centre of mass).
*/
#ifndef HHTDAE_MODAL_H
#define HHTDAE_MODAL_H

#include "hhtdae/types.h"
#include <array>
#include <string>
#include <vector>

namespace hhtdae
{

/* Where joints and forces take hold: six degrees of freedom that follow the modes */
struct ModalAttachment {
  std::string                               name;
  Vector3                                   position = Vector3::Zero(); /* undeformed, axes and origin of the FE model */
  Eigen::Matrix<double, 3, Eigen::Dynamic>  translation, rotation;      /* 3 x modes: of the point, per unit of each mode */
  /* Geometric stiffening, symmetric, modes x modes, empty: not known. What a unit force along x, y, z of the body, or moment about them, adds to the
     stiffness; to second order the point moves by translation eta - (eta^T stiffening eta)/2. */
  std::array<Eigen::MatrixXd, 6> stiffening;
};

/* A node of the FE model that the reduction has kept, by its number there: as an attachment of its own, but without geometric stiffening. It turns with the
   nodes that it shares elements with; where these tell no rotation, `rotation` is zero, and the node takes forces alone. */
struct ModalNode : ModalAttachment {
  PetscInt label = 0;
  bool     turns = true;
};

/*
  Nodal forces f of a load case as the modes see them: their resultant, their moment about the undeformed centre of mass and their work with the modes, in body
  axes and to first order in the modal coordinates,

    force + force_gradient eta,   moment + moment_gradient eta,   modal + modal_gradient eta

  Forces that stay as they are in body axes have moment_gradient = sum phi x f alone; those of a pressure that stays normal to the surface have all three.
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
  /* quadratic[p](k, l) = int phi_k,c phi_l,d dm for (c, d) = xx, yy, zz, xy, yz, zx; empty: not known, then the mass matrix can be
     Partial or Constant only. The sum of the first three is the identity. */
  std::array<Eigen::MatrixXd, 6> quadratic;

  /* The same for the angular velocity: w_c w_d adds stiffening[p] for (c, d) = xx, yy, zz, and twice it for xy, yz, zx; not with ModalMass::Constant */
  std::array<Eigen::MatrixXd, 6> stiffening;

  std::vector<ModalAttachment> attachments;
  std::vector<ModalNode>       nodes; /* by increasing label */
  std::vector<ModalLoadCase>   loads;

  PetscInt modes() const { return (PetscInt)omega.size(); }
  Matrix3  inertia() const { return moments.trace() * Matrix3::Identity() - moments; } /* undeformed, about the centre of mass */
  PetscInt attachment(const std::string &called) const                                 /* its index, -1: there is none */
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

/* How far the mass matrix follows the deformation (what Adams/Flex offers under these names) */
enum class ModalMass {
  Full,    /* all invariants */
  Partial, /* without those quadratic in the modes */
  Constant /* that of the undeformed body */
};

} // namespace hhtdae

#endif
