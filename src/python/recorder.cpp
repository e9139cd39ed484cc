#include "recorder.h"
#include "../scene/guard.h"

namespace hhtdae
{
namespace python
{

namespace
{

using RecorderPointer = std::shared_ptr<Recorder>;

PetscErrorCode Monitor(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), CheckSignals()));
  PetscCall((*static_cast<RecorderPointer *>(ctx))->look(ts, step, t));
  PetscFunctionReturn(0);
}

PetscErrorCode Destroy(void **ctx)
{
  PetscFunctionBegin;
  delete static_cast<RecorderPointer *>(*ctx);
  PetscFunctionReturn(0);
}

/* The number of the first multiple of dt after t */
PetscInt64 After(PetscReal t, double dt) { return (PetscInt64)std::floor((t + 1e-12 * std::abs(t)) / dt) + 1; }

} // namespace

PetscErrorCode Recorder::add(TS ts, PetscReal t)
{
  PetscFunctionBegin;
  PetscCall(scene_->sample(ts, t, one_));
  times_.push_back(t);
  values_.insert(values_.end(), one_.begin(), one_.end());
  PetscFunctionReturn(0);
}

void Recorder::resume(PetscReal t)
{
  const std::size_t width = times_.empty() ? 0 : values_.size() / times_.size();
  while (!times_.empty() && times_.back() > t + 1e-12 * std::abs(t)) times_.pop_back();
  values_.resize(width * times_.size());
  if (dt_ > 0) next_ = After(t, dt_);
  resumed_ = true;
}

/* For TS types other than TSHHT3, which have states at the ends of steps only; the first sample is taken at once */
PetscErrorCode Recorder::lookAtEnd(TS ts, PetscInt step, PetscReal t)
{
  PetscFunctionBegin;
  if (step >= 0 && (times_.empty() || t > times_.back())) PetscCall(add(ts, t));
  PetscFunctionReturn(0);
}

/* The values at the start are evaluated after the first step, at its beginning, when accelerations and multipliers are
   consistent. Sample times within rounding of the end of a step are moved to that end, where a sample needs no
   interpolation. A run that is solved in parts is sampled only once at the time where two parts meet. */
PetscErrorCode Recorder::look(TS ts, PetscInt step, PetscReal t)
{
  PetscReal begin;
  PetscBool ours;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  if (!ours) {
    PetscCall(lookAtEnd(ts, step, t));
    PetscFunctionReturn(0);
  }
  if (step <= 0) PetscFunctionReturn(0);
  if (resumed_) begin = t;
  else PetscCall(TSGetPrevTime(ts, &begin));
  resumed_ = false;
  if (times_.empty()) {
    PetscCall(add(ts, begin));
    if (dt_ > 0) next_ = After(begin, dt_);
  }
  if (dt_ <= 0) {
    if (t > times_.back()) PetscCall(add(ts, t));
    PetscFunctionReturn(0);
  }
  const double close = 1e-12 * std::max(std::abs(t), dt_);
  for (; next_ * dt_ <= t + close; next_++) PetscCall(add(ts, next_ * dt_ >= t - close ? t : next_ * dt_));
  PetscFunctionReturn(0);
}

void BindRecorder(py::module_ &m)
{
  py::class_<Recorder, RecorderPointer>(m, "Recorder")
    .def(py::init([](std::shared_ptr<Scene> scene, double dt) { return std::make_shared<Recorder>(std::move(scene), dt); }))
    .def("attach", [](RecorderPointer r, py::object ts) { Check(TSMonitorSet(ToTS(ts), Monitor, new RecorderPointer(std::move(r)), Destroy)); })
    .def("resume", &Recorder::resume)
    .def_property_readonly("times", [](const Recorder &r) { return FromDoubles(r.times().data(), {(py::ssize_t)r.times().size()}); })
    .def_property_readonly("values", [](const Recorder &r) {
      const py::ssize_t n = (py::ssize_t)r.times().size();
      return FromDoubles(r.values().data(), {n, n ? (py::ssize_t)r.values().size() / n : 0});
    });
  m.def("attach_signals", [](py::object ts) {
    Check(TSMonitorSet(ToTS(ts), [](TS t, PetscInt, PetscReal, Vec, void *) { return OnAllRanks(PetscObjectComm((PetscObject)t), CheckSignals()); }, nullptr, nullptr));
  });
}

} // namespace python
} // namespace hhtdae
