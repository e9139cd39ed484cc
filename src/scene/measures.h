/*
  Measures with their place among this rank's unknowns: values, and derivatives by the unknowns they depend on.

    LocalMeasure m = PlaceMeasure(localizer, Measure::distance(a, b));   while the scene is laid out, on the rank that
  will read it double       x = MeasureValue(m, evaluation);                        t, u, v, a of the local unknowns;
  bodies have moved there
*/
#ifndef HHTDAE_SCENE_MEASURES_H
#define HHTDAE_SCENE_MEASURES_H

#include "scene_data.h"
#include <functional>
#include <limits>
#include <string>

namespace hhtdae
{

struct LocalMeasure {
  Measure::Kind                       kind      = Measure::Time;
  int                                 component = 0;
  PetscInt                            i = -1, j = -1, frame = -1; /* local markers; -1: the space origin, space axes */
  Input                               input;                      /* a scalar unknown */
  double                              angle = 0; /* counted over full turns, at the last accepted step */
  PetscInt                            of[2] = {-1, -1}; /* markers of an angle, in the scene */
  std::vector<std::unique_ptr<Probe>> probes;

  void     accept(const Bodies &B);
  bool     countedAngle(PetscInt marker, PetscInt about, double *x) const
  {
    if (kind != Measure::Angle || of[0] != marker || of[1] != about) return false;
    *x = angle;
    return true;
  }
  double   longestStep(const Evaluation &e) const; /* for angles */
  PetscInt memory() const;
  void     copyMemory(double *x, bool in);
};

/* Marker motions beyond what the local unknowns of this rank hold are asked for through the localizer, in both of its
   passes. Kinetic and potential energy are not placed: they belong to the whole scene. */
LocalMeasure PlaceMeasure(Localizer &l, const Measure &m);

double MeasureValue(const LocalMeasure &m, const Evaluation &e);

/* The part of an element that has row or component `row`, which becomes the part's own; null if none has */
const Part *FindPart(const SceneData &s, PetscInt element, bool constraint, PetscInt &row);

bool NeedsAcceleration(const Measure &m);
/* Whether positions, velocities and states do not determine it, but accelerations, multipliers, variables or force states */
bool FollowsFromEquations(const SceneData &s, const Measure &m);
bool NeedsAcceleration(const Expression &f);

/* What is wrong with a measure, empty if nothing; in_equation: as an argument of an expression, which needs its
 * derivatives */
std::string CheckMeasure(const SceneData &s, const Measure &m, bool in_equation);
const char *NameOf(Measure::Kind k); /* "angular velocity" */
/* who: "variable speed"; adds what is wrong */
void CheckExpression(const SceneData &s, const std::string &who, const Expression &e, std::vector<std::string> &errors);
/* Variables, states and user's forces: adds what is wrong with them */
void CheckExpressions(const SceneData &s, std::vector<std::string> &errors);

/* The unknowns that several functions depend on, group by group, side by side as the columns of a dense matrix */
struct Columns {
  struct Part {
    PetscInt group;
    int      size, start;
  };
  std::vector<Part> parts;
  int               width = 0;

  /* where the coordinates of a body start, -1 for the ground; where a scalar is, -1 for one that was dropped */
  int body(const Bodies &B, PetscInt b);
  int scalar(const Pattern &p, const Input &i);

private:
  int add(PetscInt group, int size);
};

/* Arguments of expressions */
class MeasureSet
{
public:
  void place(Localizer &l, const Measure &m) { all_.push_back(PlaceMeasure(l, m)); }
  int  size() const { return (int)all_.size(); }

  /* when everything has been placed: the columns */
  void           connect(const Bodies &B, const Pattern &p);
  const Columns &columns() const { return columns_; }

  double value(int k, const Evaluation &e) const { return MeasureValue(all_[k], e); }
  /* adds factor times dm/du + sv dm/du' + sa dm/du'' to a row of the width of the columns */
  void addGradient(int k, const Evaluation &e, double factor, double *row) const;

  std::vector<LocalMeasure>       &all() { return all_; }
  void                             accept(const Bodies &B);
  PetscInt                         memory() const;
  void                             copyMemory(double *x, bool in);

private:
  std::vector<LocalMeasure> all_;
  std::vector<std::vector<int>>
          at_; /* columns of each: bodies of i, j, frame; or a scalar; then, of probes, bodies and multipliers */
  Columns columns_;
};

/* A batch that reads measures: what these remember of accepted steps, count, and allow as a step */
template <class Base> class ReadingBatch : public Base
{
public:
  void accept(Bodies &B) override
  {
    each([&](LocalMeasure &m) { m.accept(B); });
  }
  bool countedAngle(PetscInt i, PetscInt j, double *x) const override
  {
    bool found = false;
    read([&](const LocalMeasure &m) { found = found || m.countedAngle(i, j, x); });
    return found;
  }
  bool limitsSteps() const override
  {
    bool any = false;
    read([&](const LocalMeasure &m) { any = any || m.kind == Measure::Angle; });
    return any;
  }
  double longestStep(const Evaluation &e) const override
  {
    double least = std::numeric_limits<double>::infinity();
    read([&](const LocalMeasure &m) { least = std::min(least, m.longestStep(e)); });
    return least;
  }
  PetscInt memory() const override
  {
    PetscInt n = 0;
    read([&](const LocalMeasure &m) { n += m.memory(); });
    return n;
  }
  void copyMemory(double *x, bool in) override
  {
    each([&](LocalMeasure &m) {
      m.copyMemory(x, in);
      x += m.memory();
    });
  }

protected:
  using Visit = std::function<void(LocalMeasure &)>;
  virtual void each(const Visit &f) = 0; /* in the same order every time */

private:
  void read(const Visit &f) const { const_cast<ReadingBatch *>(this)->each(f); }
};

} // namespace hhtdae

#endif
