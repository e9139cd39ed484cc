#include "scene/output/channels.h"
#include "scene/guard.h"
#include "scene/measures.h"
#include "scene/output/energy.h"

namespace hhtdae
{

struct ChannelWork {
  std::vector<PetscMPIInt>        owner;
  std::vector<LocalMeasure>       own;   /* arguments of own channels, one after the other */
  std::vector<std::size_t> what; /* numbers of own channels */
  bool                            energies = false; /* whether a channel of any rank reads an energy of the scene */
};

namespace
{

/* Updates the memories of channels, which are angles over full turns, in accepted steps and stores them in checkpoints; adds nothing to the
   equations. */
class ChannelBatch : public ReadingBatch<Batch>
{
public:
  explicit ChannelBatch(std::shared_ptr<ChannelWork> work) : work_(std::move(work)) {}

  void pattern(Pattern &) override {}
  void residual(Evaluation &) override {}
  void jacobian(Evaluation &) override {}

protected:
  void each(const Visit &visit) override
  {
    for (LocalMeasure &m : work_->own) visit(m);
  }

private:
  std::shared_ptr<ChannelWork> work_;
};

} // namespace

PetscErrorCode LocalizeChannels(Runtime &R, Localizer &l)
{
  auto work = std::make_shared<ChannelWork>();
  PetscFunctionBegin;
  for (const ChannelData &c : R.scene.channels) {
    work->owner.push_back(OwnerOf(*R.model, c.value));
    for (const Measure &m : c.value.arguments) {
      work->energies = work->energies || m.kind == Measure::KineticEnergy || m.kind == Measure::PotentialEnergy;
      if (work->owner.back() == R.rank) work->own.push_back(PlaceMeasure(l, m));
    }
    if (work->owner.back() == R.rank) work->what.push_back((std::size_t)(&c - R.scene.channels.data()));
  }
  R.channels = work;
  if (!work->own.empty()) R.batches.push_back(std::make_unique<ChannelBatch>(work));
  PetscFunctionReturn(0);
}

const std::vector<PetscMPIInt> &ChannelOwners(const Runtime &R) { return R.channels->owner; }

bool ChannelsFollowFromEquations(const Runtime &R)
{
  const auto &all = R.scene.channels;
  return std::any_of(all.begin(), all.end(), [&](const ChannelData &c) {
    return std::any_of(c.value.arguments.begin(), c.value.arguments.end(), [&](const Measure &m) { return FollowsFromEquations(R.scene, m); });
  });
}

PetscErrorCode ChannelValues(const Runtime &R, const Evaluation &e, std::vector<double> &values)
{
  Balance b;
  PetscFunctionBegin;
  if (R.channels->energies) PetscCall(MakeBalance(R, e, b));
  const PetscErrorCode failed = Guarded([&] {
    const LocalMeasure *m = R.channels->own.data();
    for (std::size_t channel : R.channels->what) {
      const Expression &value = R.scene.channels[channel].value;
      std::vector<Real> x;
      for (std::size_t k = 0; k < value.arguments.size(); k++, m++) {
        if (m->kind == Measure::KineticEnergy) x.push_back(Real(b.kinetic));
        else if (m->kind == Measure::PotentialEnergy) x.push_back(Real(b.potential()));
        else x.push_back(Real(MeasureValue(*m, e)));
      }
      values.push_back(value.f(x.data()).value());
    }
    return PetscErrorCode(0);
  });
  PetscCall(OnAllRanks(R.scene.comm, failed));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
