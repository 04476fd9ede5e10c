// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

#include "dapple/base/error.h"
#include "dapple/image/atomic_file.h"

namespace dapple::image {

inline std::unique_ptr<OIIO::ImageOutput> make_image_output(const std::string& path, const char* format,
                                                            AtomicFile& file) {
  std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(format);
  if (!out) throw IoError("this build cannot write " + std::string(format) + " images: \"" + path + "\"");
  if (!out->set_ioproxy(&file)) throw IoError("cannot write \"" + path + "\": " + out->geterror());
  return out;
}

/// Runs a body that returns false or throws where OpenImageIO fails, and puts the file in place if all went well. The
/// body must open the name it is given: the multi-part EXR writer goes round the sink and makes that file itself.
template <class F>
void write_atomically(const std::string& path, const char* format, F body) {
  AtomicFile file(path);
  const std::unique_ptr<OIIO::ImageOutput> out = make_image_output(path, format, file);
  bool done = false;
  std::string why;
  try {
    done = body(*out, file.part_path()) && out->close();
    if (!done) why = out->geterror();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    why = e.what();
  }
  if (done) return file.commit();
  file.give_up(why);
}

}  // namespace dapple::image
