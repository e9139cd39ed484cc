/* What the user of hhtreduce asks for. */
#ifndef HHTDAE_HHTREDUCE_OPTIONS_H
#define HHTDAE_HHTREDUCE_OPTIONS_H

#include "hhtdae/flexible.h"

namespace hhtreduce
{

extern const char *const help;

struct Task {
  enum Kind { None, ReduceModel, Info, Picture } kind = None;

  /* a model to be reduced */
  std::string                             mesh, calculix, stiffness, mass, nodes, sets, output, units, name;
  std::map<std::string, hhtdae::Material> materials;
  hhtdae::Reduction                       reduction;
  bool                                    stress = false, quiet = false;

  /* a body to be shown */
  std::string body, vtu;
  PetscInt    mode        = -1;
  double      scale       = 0;
  bool        scale_given = false;
};

/* Words that PETSc must not see: -info of a body's file is ours, alone -help is answered by us */
struct Arguments {
  std::vector<std::string> words;      /* for PETSc */
  std::string              positional; /* the last word that is neither an option nor its value */
  bool                     help_alone = false;

  Arguments(int argc, char **argv);
};

/* Options to a task; what is wrong with them is an error on all ranks */
PetscErrorCode ReadTask(const Arguments &arguments, Task *task);

/* Options that nobody has asked for are named on standard error */
PetscErrorCode WarnOfUnused();

/* values.cpp */
std::vector<std::string> Split(const std::string &text, char separator);
bool                     Number(const std::string &text, double *value);

/* Lists in the words of the command line; the text says what is wrong */
std::string ParseMaterials(const std::string &text, std::map<std::string, hhtdae::Material> *materials);
std::string ParseAttachments(const std::string &text, std::vector<hhtdae::Attachment> *attachments);
std::string ParsePressures(const std::string &text, std::vector<hhtdae::LoadCase> *loads);
std::string ReadLoads(const std::string &text, std::vector<hhtdae::LoadCase> *loads); /* from their files */
std::string ParseNumbers(const std::string &text, std::vector<PetscInt> *numbers);

} // namespace hhtreduce

#endif
