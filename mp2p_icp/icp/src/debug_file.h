#pragma once

#include <mp2p_icp/LogRecord.h>

namespace mp2p_icp
{
/** Writes a log under the name that its parameters ask for, in folders that are made as needed.
 *
 * What the tokens stand for has characters that are no part of a file's name replaced by `_`. `$UNIQUE_ID` is
 * a number that no file of that name has yet, so that logs of other threads, programs and earlier runs stay.
 * Without it a file of that name is replaced, at once and whole. \exception DataError if it cannot be
 * written.
 */
void write_debug_file(const LogRecord& log);

}  // namespace mp2p_icp
