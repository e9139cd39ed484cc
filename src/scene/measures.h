/*
  Measures as functions of this rank's local unknowns: values, and derivatives by the unknowns on which they depend.

    LocalMeasure m = PlaceMeasure(localizer, Measure::distance(a, b));   during the layout, on the rank that evaluates the measure
    double       x = MeasureValue(m, evaluation);                        after the bodies have been moved to the state of the evaluation
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
  PetscInt                            i = -1, j = -1, frame = -1; /* local markers; -1 for i and j: the origin of space; -1 for frame: space axes */
  Input                               input;                      /* the scalar unknown, for measures that are one */
  double                              angle = 0;                  /* rad, with full turns, at the last accepted step */
  PetscInt                            of[2] = {-1, -1};           /* for an angle: numbers of its markers in the scene */
  std::vector<std::unique_ptr<Probe>> probes;

  void     accept(const Bodies &B);
  bool     countedAngle(PetscInt marker, PetscInt about, double *x) const
  {
    if (kind != Measure::Angle || of[0] != marker || of[1] != about) return false;
    *x = angle;
    return true;
  }
  double   longestStep(const Evaluation &e) const; /* upper bound on the step size, for angles */
  PetscInt memory() const;
  void     copyMemory(double *x, bool in);
};

/* Requests the needed unknowns of other ranks through the localizer, in both of its passes. Kinetic and potential energy
   request none: they are sums over the whole scene, which all ranks compute together. */
LocalMeasure PlaceMeasure(Localizer &l, const Measure &m);

double MeasureValue(const LocalMeasure &m, const Evaluation &e);

/* The part of an element that contains row or component `row`; `row` becomes its number in that part. Null if there is no such part */
const Part *FindPart(const SceneData &s, PetscInt element, bool constraint, PetscInt &row);

bool NeedsAcceleration(const Measure &m);
/* Whether the measure depends on accelerations, multipliers, variables or force states, not only on positions, velocities and states */
bool FollowsFromEquations(const SceneData &s, const Measure &m);
bool NeedsAcceleration(const Expression &f);

/* What is wrong with a measure, as text; empty if nothing. in_equation: whether the measure is an argument of an
   expression in the equations, which need its derivatives */
std::string CheckMeasure(const SceneData &s, const Measure &m, bool in_equation);
const char *NameOf(Measure::Kind k); /* "angular velocity" */
/* Adds the errors of an expression. who: its owner in messages, such as "variable speed" */
void CheckExpression(const SceneData &s, const std::string &who, const Expression &e, std::vector<std::string> &errors);
/* Adds the errors of variables, states and users' forces */
void CheckExpressions(const SceneData &s, std::vector<std::string> &errors);

/* The unknowns on which several functions depend, as columns of a dense matrix, group by group */
struct Columns {
  struct Part {
    PetscInt group;
    int      size, start;
  };
  std::vector<Part> parts;
  int               width = 0;

  /* First column of a body, or -1 for the ground; column of a scalar, or -1 for a dropped multiplier */
  int body(const Bodies &B, PetscInt b);
  int scalar(const Pattern &p, const Input &i);

private:
  int add(PetscInt group, int size);
};

/* The measures that are arguments of an expression */
class MeasureSet
{
public:
  void place(Localizer &l, const Measure &m) { all_.push_back(PlaceMeasure(l, m)); }
  int  size() const { return (int)all_.size(); }

  /* Determines the columns; called after all measures have been placed */
  void           connect(const Bodies &B, const Pattern &p);
  const Columns &columns() const { return columns_; }

  double value(int k, const Evaluation &e) const { return MeasureValue(all_[k], e); }
  /* Adds factor (dm/du + sv dm/du' + sa dm/du'') of measure k to `row`, an array with an entry for each column */
  void addGradient(int k, const Evaluation &e, double factor, double *row) const;

  std::vector<LocalMeasure>       &all() { return all_; }
  void                             accept(const Bodies &B);
  PetscInt                         memory() const;
  void                             copyMemory(double *x, bool in);

private:
  std::vector<LocalMeasure> all_;
  std::vector<std::vector<int>>
          at_; /* columns of each measure: of the bodies of i, j and frame, or of its scalar; then those of its probes' bodies and multipliers */
  Columns columns_;
};

/* A batch that reads measures. Its memory, counted angles and step limits are those of the measures. */
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
  double longestStep(const Evaluation &e, const Horizon &) const override
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
  virtual void each(const Visit &f) = 0; /* calls f for all measures, always in the same order */

private:
  void read(const Visit &f) const { const_cast<ReadingBatch *>(this)->each(f); }
};

} // namespace hhtdae

#endif
