#include "scene/output/base64.h"
#include "scene/output/page_bytes.h"

#if defined(HHTDAE_PAGE)
  #include <zlib.h>
#endif

namespace hhtdae
{

#if defined(HHTDAE_PAGE)

PetscErrorCode PageElement(const PageBytes &bytes, const std::string &kind, std::string *element)
{
  uLongf                     size = compressBound((uLong)bytes.all.size());
  std::vector<unsigned char> packed(size);
  PetscFunctionBegin;
  const int status = compress2(packed.data(), &size, bytes.all.data(), (uLong)bytes.all.size(), Z_DEFAULT_COMPRESSION);
  PetscCheck(status == Z_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "zlib cannot compress %zu bytes of a page, error %d", bytes.all.size(), status);
  *element = "<script type=\"application/octet-stream\" data-kind=\"" + kind + "\">" + Base64(packed.data(), size) + "</script>\n";
  PetscFunctionReturn(0);
}

#else

PetscErrorCode PageElement(const PageBytes &, const std::string &, std::string *)
{
  PetscFunctionBegin;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_SUP, "the library was built without pages");
}

#endif

} // namespace hhtdae
