// SPDX-License-Identifier: Apache-2.0
#include "app/sound_log.hpp"

#include "app/common.hpp"
#include "app/log_files.hpp"

namespace wheelwright::app {

SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                        const CommonOptions& options, WheelPose pose) {
  return results::open_sound_log(paths, robot, reader_options(options), options.despite, pose,
                                 static_cast<std::size_t>(options.threads));
}

}  // namespace wheelwright::app
