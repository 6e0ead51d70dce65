// What other parts of the emulated runtime have to do with streams.
#pragma once

#include <string>
#include <string_view>

namespace breccia::cuda_emulation {

/// The host waits for all streams. Throws EmulationError where one waits for the host.
void run_all();
/// For what the runtime may wait for the whole device to do. Throws EmulationError.
void refuse_where_host_is_awaited(const std::string& what);
/// By BRECCIA_EMULATED_DRIVER (runtime_api.hpp).
bool driver_is(std::string_view kind);

}  // namespace breccia::cuda_emulation
