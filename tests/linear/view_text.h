/* The text that a PETSc object prints about itself */
#ifndef HHTDAE_TEST_VIEW_TEXT_H
#define HHTDAE_TEST_VIEW_TEXT_H

#include <gtest/gtest.h>
#include <petscviewer.h>
#include <string>

/* view(viewer) prints the object */
template <class View> std::string ViewText(View view, PetscViewerFormat format = PETSC_VIEWER_DEFAULT)
{
  PetscViewer viewer;
  char        text[4096] = "";
  FILE       *file       = tmpfile();
  EXPECT_EQ(PetscViewerASCIIOpenWithFILE(PETSC_COMM_SELF, file, &viewer), 0);
  EXPECT_EQ(PetscViewerPushFormat(viewer, format), 0);
  EXPECT_EQ(view(viewer), 0);
  EXPECT_EQ(PetscViewerFlush(viewer), 0);
  rewind(file);
  text[fread(text, 1, sizeof text - 1, file)] = 0;
  EXPECT_EQ(PetscViewerDestroy(&viewer), 0);
  fclose(file);
  return text;
}

#endif
