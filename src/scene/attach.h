/*
  Attachments of flexible bodies in the description: a frame of its own, a body without mass, which six constraints hold at the point of the flexible body that
  follows its modes. Assembly and the search for redundant constraints see them; a run has neither their coordinates nor their multipliers, see carrier.h.

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
  bool          isExplicit() const override { return true; }
  bool          everIndependent() const override { return true; } /* each has a frame of its own */
  bool          curves() const override { return false; }
  bool          usesVelocities() const override { return false; }
  void          localize(Localizer &, std::vector<std::unique_ptr<Batch>> &) const override {}
  void          describe(const SceneData &s, PetscInt e, double t, DescribedRows &rows) const override;
  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override;
};

/* Of a probe that reads an attachment: memories of the elements on it, as the batches of the run have them */
void RecallMemories(Probe &p, const std::vector<std::unique_ptr<Batch>> &batches);

} // namespace hhtdae

#endif
