/* Samples of the channels: every rank evaluates its own channels, the first rank collects the values and writes them in blocks. */
#include "scene/output/table.h"
#include "scene/output/channels.h"
#include "scene/output/recorder.h"
#include <petsctime.h>

namespace hhtdae
{

namespace
{

/* A block is written when it has this many samples, or when its first sample is older than this many seconds of real time */
constexpr std::size_t max_block_samples = 256;
constexpr double      max_block_age     = 10;

class Table : public Task
{
public:
  Table(Runtime &R, const OutputSettings &o) : Task(o.dt), csv_(o.csv), hdf5_(o.file)
  {
    for (const ChannelData &c : R.scene.channels) {
      head_.name.push_back(c.name);
      head_.unit.push_back(c.unit);
    }
    from_equations = ChannelsFollowFromEquations(R);
    column_.resize(R.size);
    for (std::size_t c = 0; c < head_.name.size(); c++) column_[ChannelOwners(R)[c]].push_back(c);
  }

  PetscErrorCode record(Runtime &R, Evaluation &e) override
  {
    PetscFunctionBegin;
    if (time_.empty()) PetscCall(PetscTime(&since_));
    time_.push_back(e.t);
    PetscCall(ChannelValues(R, e, own_));
    if (time_.size() >= max_block_samples) PetscCall(write(R)); /* a long step may contain many samples */
    PetscFunctionReturn(0);
  }

  PetscErrorCode stepped(Runtime &R) override
  {
    PetscLogDouble now;
    PetscFunctionBegin;
    if (time_.empty()) PetscFunctionReturn(0);
    PetscCall(PetscTime(&now));
    int full = now - since_ > max_block_age; /* by the clock of the first rank */
    if (R.size > 1) PetscCallMPI(MPI_Bcast(&full, 1, MPI_INT, 0, R.scene.comm));
    if (full) PetscCall(write(R));
    PetscFunctionReturn(0);
  }

  PetscErrorCode finish(Runtime &R) override
  {
    PetscFunctionBegin;
    if (!time_.empty() || rows_ == 0) PetscCall(write(R));
    PetscFunctionReturn(0);
  }

  int slot() const override { return 0; }

  PetscErrorCode save(Runtime &R, double *x) override
  {
    PetscFunctionBegin;
    if (!time_.empty()) PetscCall(write(R));
    x[0] = (double)rows_;
    x[1] = (double)csv_end_;
    PetscFunctionReturn(0);
  }

  PetscErrorCode resume(Runtime &R, const double *x) override
  {
    PetscFunctionBegin;
    rows_    = (std::size_t)x[0];
    csv_end_ = (long)x[1];
    if (R.rank || !rows_) PetscFunctionReturn(0);
    if (!csv_.empty()) PetscCall(ShortenFile(csv_, csv_end_, &csv_there_));
    if (!hdf5_.empty()) PetscCall(ShortenHDF5(hdf5_, rows_, head_, &hdf5_there_));
    PetscFunctionReturn(0);
  }

private:
  TableHead                             head_;
  std::string                           csv_, hdf5_;
  std::vector<std::vector<std::size_t>> column_; /* numbers of the channels of every rank */
  std::vector<double>                   time_, own_;
  PetscLogDouble                        since_ = 0;
  std::size_t                           rows_    = 0; /* number of samples in the files */
  long                                  csv_end_ = 0; /* length of the CSV file in bytes */
  bool                                  csv_there_ = false, hdf5_there_ = false; /* whether the files exist; on the first rank */

  /* Gathers the block on the first rank, with the channels in their order */
  PetscErrorCode collect(const Runtime &R, Block &block)
  {
    std::vector<int>    count(R.size), start(R.size + 1, 0);
    const std::size_t   samples = time_.size(), channels = head_.name.size();
    std::vector<double> all(R.rank == 0 ? samples * channels : 0);
    PetscFunctionBegin;
    for (PetscMPIInt r = 0; r < R.size; r++) {
      count[r]     = (int)(samples * column_[r].size());
      start[r + 1] = start[r] + count[r];
    }
    PetscCallMPI(MPI_Gatherv(own_.data(), (int)own_.size(), MPI_DOUBLE, all.data(), count.data(), start.data(), MPI_DOUBLE, 0, R.scene.comm));
    block.time = std::move(time_);
    time_.clear();
    own_.clear();
    if (R.rank) PetscFunctionReturn(0);
    block.values.resize(all.size());
    const double *x = all.data();
    for (PetscMPIInt r = 0; r < R.size; r++)
      for (std::size_t s = 0; s < samples; s++)
        for (std::size_t c : column_[r]) block.values[s * channels + c] = *x++;
    PetscFunctionReturn(0);
  }

  PetscErrorCode write(Runtime &R)
  {
    Block block;
    PetscFunctionBegin;
    PetscCall(collect(R, block));
    rows_ += block.time.size();
    if (R.rank) PetscFunctionReturn(0);
    if (!csv_.empty()) PetscCall(AppendCSV(csv_, !csv_there_, head_, block, &csv_end_));
    if (!hdf5_.empty()) PetscCall(AppendHDF5(hdf5_, !hdf5_there_, head_, block));
    csv_there_ = hdf5_there_ = true;
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode MakeTable(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task)
{
  PetscFunctionBegin;
  if (o.csv.empty() && o.file.empty()) PetscFunctionReturn(0);
  PetscCheck(!R.scene.channels.empty(), R.scene.comm, PETSC_ERR_ARG_WRONGSTATE, "%s was asked for, but the scene has no channels: Scene::channel() makes them",
             o.csv.empty() ? o.file.c_str() : o.csv.c_str());
  PetscCheck(R.scene.channels.size() == ChannelOwners(R).size(), R.scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "channel %s came too late: the scene is fixed from its set-up or first run on", R.scene.channels.back().name.c_str());
  task = std::make_unique<Table>(R, o);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
