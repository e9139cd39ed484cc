/*
  Attachments of flexible bodies in the description. Each is a frame, described as a body without mass, that six constraints fix to a point of the
  flexible body, which moves with its modes. Only assembly and the redundancy check use these constraints; a run has neither coordinates nor
  multipliers for attachments, see carrier.h. With i the frame and e the point of the flexible body:

    x_i - x_e = 0,  axes of i parallel to those of e,   x_e = r + A (s + Psi_x eta),  R_e = A exp([Psi_theta eta])
*/
#ifndef HHTDAE_SCENE_ATTACH_H
#define HHTDAE_SCENE_ATTACH_H

#include "carrier.h"
#include "scene_data.h"

namespace hhtdae
{

class AttachStore : public StoreBase
{
public:
  struct Item {
    PetscInt element = -1, marker[2] = {-1, -1}; /* markers on the flexible body and on the frame */
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
  bool          isExplicit() const override { return true; }
  bool                   neverRedundant() const override { return true; } /* each attachment has its own frame, so that its rows are independent */
  bool                   hasGeometricStiffness() const override { return false; }
  bool          usesVelocities() const override { return false; }
  void          localize(Localizer &, std::vector<std::unique_ptr<Batch>> &) const override {}
  void          describe(const SceneData &s, PetscInt e, double t, DescribedRows &rows) const override;
  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override;
};

/* Copies the memories of elements from the run's batches to the probe of an attachment, which contains probes of the
   elements that act on its frame */
void RecallMemories(Probe &p, const std::vector<std::unique_ptr<Batch>> &batches);

} // namespace hhtdae

#endif
