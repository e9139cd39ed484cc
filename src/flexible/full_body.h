/*
  A finite-element model as it is, in a scene: three absolute coordinates a node, in parallel. Rows of own nodes are computed from
  K and M (small displacements) or from the elements that touch own nodes (large ones), those of other ranks' among them, as joints
  are in scenes; attachments are rigid frames without mass, tied to their nodes by multipliers.
*/
#ifndef HHTDAE_FLEXIBLE_FULL_BODY_H
#define HHTDAE_FLEXIBLE_FULL_BODY_H

#include "hhtdae/flexible.h"
#include "scene/extension.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* Nodes tied to the frame of an attachment; the same on every rank */
struct TieNodes {
  Tie                   tie;
  Marker                frame;  /* marker of the frame, at its origin */
  std::vector<PetscInt> node;   /* global numbers, sorted */
  std::vector<Vector3>  arm;    /* from the attachment's point, axes of the FE model */
  std::vector<double>   weight; /* sum 1 */
  std::vector<PetscInt> lambda; /* rigid: number of the node's first multiplier among its owner's */
  PetscMPIInt           owner = 0;  /* average: the rank whose node comes first has the six multipliers */
  PetscInt              first = 0;  /* average: number of the first among its owner's multipliers */
};

class FullExtension : public Extension
{
public:
  std::string           name;
  FullBody              spec;
  const FeModel        *model = nullptr;
  std::vector<PetscInt> node_first; /* first node of each rank, and the number of nodes */
  std::vector<double>   u, v;       /* own coordinates at the start */
  std::vector<TieNodes> ties;
  PetscInt              own_multipliers = 0;

  std::vector<PetscInt>  near;      /* global numbers of own nodes and those that they are coupled with, sorted */
  std::vector<double>    near_x;    /* their places at the start, undeformed */
  std::vector<FeElement> elements;  /* that touch own nodes; FeLaw::Large */
  /* rows of own nodes, block by block, in space axes; FeLaw::Small */
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
