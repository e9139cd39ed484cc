/* Parameters of a scene. After a change of a parameter or of the StartPolicy, the calls that describe the scene are repeated. */
#include "journal.h"
#include <cmath>

namespace hhtdae
{

namespace
{

std::size_t Handles(const SceneData &s) { return s.markers.size() + s.bodies.size(); }

/* What calls add to */
std::size_t Entries(const SceneData &s)
{
  std::size_t parts = 0;
  for (const StoreBase *store : s.order) parts += (std::size_t)store->size();
  return Handles(s) + s.elements.size() + s.variables.size() + s.states.size() + s.extensions.size() + s.channels.size() + s.shapes.size() + s.lines.size() + s.errors.size() + parts;
}

} // namespace

void Scene::record(std::function<void(Scene &)> call)
{
  journal_->calls.push_back(std::move(call));
  journal_->before.push_back(Handles(data()));
  journal_->entries = Entries(data());
}

/* The calls that describe are as many as before, and so is what they have added, except what a function has added before it threw: for that all is described anew. This runs
   while the exception is on its way; a description that fails here will fail in the next set-up. */
void Scene::takeBack()
{
  journal_->calls.pop_back();
  journal_->before.pop_back();
  if (Entries(data()) == journal_->entries) return;
  journal_->stale = true;
  try {
    describeAnew();
  } catch (...) {
  }
}

Parameter Scene::parameter(const std::string &name, double value)
{
  const SceneData &s = data();
  const auto fault = [&](const char *what) {
    journal_->errors.push_back("parameter " + name + ": " + what);
    data().errors.push_back(journal_->errors.back());
  };
  if (!s.bodies.empty() || !s.extensions.empty() || !s.markers.empty() || !s.elements.empty() || !s.variables.empty() || !s.states.empty() || !s.channels.empty() || !s.shapes.empty())
    fault("it came too late, parameters are made before everything else but gravity");
  if (journal_->parameters.count(name)) fault("there is one of this name");
  if (!std::isfinite(value)) fault("its value is not finite");
  Parameter &p = journal_->parameters[name];
  *p.value_    = value;
  data().parameters.push_back({name, p.value_, value});
  return p;
}

PetscErrorCode Scene::set(const std::string &name, double value)
{
  PetscFunctionBegin;
  std::string known;
  for (const auto &p : journal_->parameters) known += (known.empty() ? "" : ", ") + p.first;
  PetscCheck(journal_->parameters.count(name), data().comm, PETSC_ERR_ARG_WRONG, "Scene::set(): there is no parameter %s, %s%s", name.c_str(),
             known.empty() ? "in fact none" : "but ", known.c_str());
  PetscCheck(std::isfinite(value), data().comm, PETSC_ERR_ARG_OUTOFRANGE, "Scene::set(): %s cannot be %g", name.c_str(), value);
  double &now     = *journal_->parameters[name].value_;
  journal_->stale = journal_->stale || now != value;
  now             = value;
  PetscFunctionReturn(0);
}

/* A function that makes other markers than at first is an error, after which nothing else is described */
void Scene::repeatCalls()
{
  SceneData   &s = data();
  const Nested nested(*this);
  for (std::size_t k = 0; k < journal_->calls.size(); k++) {
    const std::size_t first = s.elements.size(), errors = s.errors.size();
    journal_->calls[k](*this);
    if (k + 1 == journal_->calls.size() || Handles(s) == journal_->before[k + 1] || s.errors.size() > errors) continue;
    s.errors.push_back((first < s.elements.size() ? s.elements.back().name : "what is described by a function") +
                       ": its function makes other markers or attachments than at first, so that the handles of all later ones would stand for others; make them outside of it");
    break;
  }
}

/* Repeats the recorded calls with a new model; existing runs keep the old one, and so does the scene if a function throws */
void Scene::describeAnew()
{
  if (!journal_->stale) return;
  auto       next = std::make_shared<Model>();
  SceneData &s    = next->scene;
  s.number        = number_;
  s.comm          = data().comm;
  s.planar        = data().planar;
  s.errors        = journal_->errors;
  s.told          = data().told;
  s.parameters    = data().parameters;
  for (ParameterData &p : s.parameters) p.described = *p.present;
  model_.swap(next);
  try {
    repeatCalls();
  } catch (...) {
    model_.swap(next);
    throw;
  }
  journal_->stale = false;
}

} // namespace hhtdae
