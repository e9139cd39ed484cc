/* The command line of hhtreduce. */
#ifndef HHTDAE_HHTREDUCE_OPTIONS_H
#define HHTDAE_HHTREDUCE_OPTIONS_H

#include "hhtdae/flexible.h"

namespace hhtreduce
{

extern const char *const help;

struct Task {
  enum Kind { None, ReduceModel, Info, Picture } kind = None;

  /* for a reduction */
  std::string                             mesh, calculix, stiffness, mass, nodes, sets, output, units, name;
  std::map<std::string, hhtdae::Material> materials;
  hhtdae::Reduction                       reduction;
  bool                                    stress = false, quiet = false;

  /* for -info and -vtu */
  std::string body, vtu;
  PetscInt    mode        = -1;
  double      scale       = 0;
  bool        scale_given = false;
};

/* Splits off the words that PETSc must not see: -info with a body's file, and -help without other options, are handled here */
struct Arguments {
  std::vector<std::string> words;      /* for PETSc */
  std::string              positional; /* the last word that is neither an option nor its value */
  bool                     help_alone = false;

  Arguments(int argc, char **argv);
};

/* Converts the options to a task; errors are raised on all ranks */
PetscErrorCode ReadTask(const Arguments &arguments, Task *task);

/* Lists unused options on standard error */
PetscErrorCode WarnOfUnused();

/* values.cpp */
std::vector<std::string> Split(const std::string &text, char separator);
bool                     Number(const std::string &text, double *value);

/* Parse values of options; return an error message, or "" */
std::string ParseMaterials(const std::string &text, std::map<std::string, hhtdae::Material> *materials);
std::string ParseAttachments(const std::string &text, std::vector<hhtdae::Attachment> *attachments);
std::string ParsePressures(const std::string &text, std::vector<hhtdae::LoadCase> *loads);
std::string ReadLoads(const std::string &text, std::vector<hhtdae::LoadCase> *loads); /* from their files */
std::string ParseNumbers(const std::string &text, std::vector<PetscInt> *numbers);

} // namespace hhtreduce

#endif
