/*
  An unreduced finite-element model in a scene, distributed over ranks, with three absolute coordinates per node. Rows of own nodes are computed from
  K and M (small displacements) or from all elements with own nodes (large displacements); elements with nodes of several ranks are computed on each of these, as joints
  are. Attachments are massless rigid frames, tied to their nodes by multipliers.
*/
#ifndef HHTDAE_FLEXIBLE_FULL_BODY_H
#define HHTDAE_FLEXIBLE_FULL_BODY_H

#include "hhtdae/flexible.h"
#include "scene/extension.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* The nodes tied to the frame of an attachment; the same on every rank */
struct TieNodes {
  Tie                   tie;
  Marker                frame;     /* marker of the frame, at its origin */
  std::vector<PetscInt> node;      /* global numbers, sorted */
  std::vector<Vector3>  arm;       /* from the attachment's point, axes of the FE model */
  std::vector<double>   weight;    /* sum 1 */
  std::vector<PetscInt> lambda;    /* rigid: for each node, number of its first multiplier among those of its owner */
  PetscMPIInt           owner = 0; /* average: the owner of the first node, which has the six multipliers */
  PetscInt              first = 0; /* average: number of the first one among the owner's multipliers */
};

class FullExtension : public Extension
{
public:
  std::string           name;
  FullBody              spec;
  const FeModel        *model = nullptr;
  std::vector<PetscInt> node_first; /* first node of each rank; at the end the number of nodes */
  std::vector<double>   u, v;       /* initial coordinates and velocities of own nodes */
  std::vector<TieNodes> ties;
  PetscInt              own_multipliers = 0;

  std::vector<PetscInt>  near;     /* global numbers of own nodes and of nodes coupled to them, sorted */
  std::vector<double>    near_x;   /* their undeformed initial positions, in space axes */
  std::vector<FeElement> elements; /* FeLaw::Large: elements with own nodes */
  /* FeLaw::Small: the 3 x 3 blocks of the rows of own nodes in K and M, in space axes; block_near: index in `near` of the column's node */
  std::vector<PetscInt>  block_first, block_near;
  std::vector<Matrix3>   block_K, block_M;

  PetscInt coordinates() const override { return 3 * model->own; }
  PetscInt multipliers() const override { return own_multipliers; }
  void     initial(double *x, double *y) const override;
  void     startFrom(const double *x, const double *y) override;
  bool     vectors() const override { return true; }
  void     localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override;
  PetscErrorCode pageMesh(std::size_t most_nodes, std::unique_ptr<PageMesh> *mesh) const override; /* full_surface.cpp */

  const std::string &bodyName() const override { return name; }
  std::string    nameOf(PetscMPIInt rank, PetscInt unknown) const override;

  PetscMPIInt ownerOf(PetscInt node) const;
  PetscInt    number(PetscInt node) const; /* global number of its first coordinate, once start is known */
  PetscInt    multiplier(PetscMPIInt rank, PetscInt i) const; /* global number */
  Vector3     placed(const double *X) const { return spec.position + spec.rotation * Eigen::Map<const Vector3>(X); }
};

/* full_matrices.cpp: own rows of K and M */
PetscErrorCode ExtractBlocks(FullExtension &x);
/* full_matrices.cpp, full_elements.cpp, full_ties.cpp */
void LocalizeMatrices(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches);
void LocalizeElements(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches);
void LocalizeTies(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches);

} // namespace hhtdae

#endif
