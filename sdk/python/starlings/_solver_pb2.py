"""The messages of solver.proto. Written by generate.py: change the file there, not here."""

import base64

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_DESCRIPTION = base64.b64decode(
    "Cgxzb2x2ZXIucHJvdG8SE3N0YXJsaW5ncy5zb2x2ZXIudjEiLQoPRGVzY3JpYmVSZXF1ZXN0EhoKCHByb3RvY29sGAEgASgNUghw"
    "cm90b2NvbCLlAwoLRGVzY3JpcHRpb24SGgoIcHJvdG9jb2wYASABKA1SCHByb3RvY29sEhIKBG5hbWUYAiABKAlSBG5hbWUSEgoE"
    "c2F5cxgDIAEoCVIEc2F5cxI1CgZzdGF0ZXMYBCADKAsyHS5zdGFybGluZ3Muc29sdmVyLnYxLlF1YW50aXR5UgZzdGF0ZXMSPQoK"
    "cGFyYW1ldGVycxgFIAMoCzIdLnN0YXJsaW5ncy5zb2x2ZXIudjEuUXVhbnRpdHlSCnBhcmFtZXRlcnMSNwoHb3V0cHV0cxgGIAMo"
    "CzIdLnN0YXJsaW5ncy5zb2x2ZXIudjEuUXVhbnRpdHlSB291dHB1dHMSNQoGaW5wdXRzGAcgAygLMh0uc3RhcmxpbmdzLnNvbHZl"
    "ci52MS5RdWFudGl0eVIGaW5wdXRzEhgKB3Jlc3RhcnQYCCABKAhSB3Jlc3RhcnQSJAoNZGV0ZXJtaW5pc3RpYxgJIAEoCFINZGV0"
    "ZXJtaW5pc3RpYxIcCglvYnNlcnZlcnMYCiADKAlSCW9ic2VydmVycxIUCgVob3N0cxgLIAMoCVIFaG9zdHMSOAoIbWVhc3VyZXMY"
    "DCADKAsyHC5zdGFybGluZ3Muc29sdmVyLnYxLk1lYXN1cmVSCG1lYXN1cmVzIuIBCghRdWFudGl0eRISCgRuYW1lGAEgASgJUgRu"
    "YW1lEhIKBHVuaXQYAiABKAlSBHVuaXQSEgoEc2l6ZRgDIAEoDVIEc2l6ZRISCgRyb2xlGAQgASgJUgRyb2xlEhMKAmxvGAUgASgB"
    "SABSAmxviAEBEhMKAmhpGAYgASgBSAFSAmhpiAEBEigKDWRlZmF1bHRfdmFsdWUYByABKAFIAlIMZGVmYXVsdFZhbHVliAEBEhIK"
    "BHNheXMYCCABKAlSBHNheXNCBQoDX2xvQgUKA19oaUIQCg5fZGVmYXVsdF92YWx1ZSI3CgdNZWFzdXJlEhYKBm91dHB1dBgBIAEo"
    "CVIGb3V0cHV0EhQKBXN0YXRlGAIgASgJUgVzdGF0ZSKhBAoKUnVuUmVxdWVzdBIaCghwYXJ0aWNsZRgBIAEoDVIIcGFydGljbGUS"
    "FgoGcmVjb3JkGAIgASgNUgZyZWNvcmQSHgoKcGFyYW1ldGVycxgDIAEoDFIKcGFyYW1ldGVycxI0Cgdpbml0aWFsGAQgAygLMhou"
    "c3RhcmxpbmdzLnNvbHZlci52MS5OYW1lZFIHaW5pdGlhbBIZCgVzdGF0ZRgFIAEoDEgAUgVzdGF0ZYgBARIZCgVzdGFydBgGIAEo"
    "AUgBUgVzdGFydIgBARIUCgV0aW1lcxgHIAEoDFIFdGltZXMSGAoHb3V0cHV0cxgIIAMoCVIHb3V0cHV0cxIaCghvYnNlcnZlZBgJ"
    "IAEoDFIIb2JzZXJ2ZWQSOQoIb2JzZXJ2ZXIYCiABKAsyHS5zdGFybGluZ3Muc29sdmVyLnYxLk9ic2VydmVyUghvYnNlcnZlchIz"
    "CgZpbnB1dHMYCyADKAsyGy5zdGFybGluZ3Muc29sdmVyLnYxLlNpZ25hbFIGaW5wdXRzEi8KBXRlcm1zGAwgAygLMhkuc3Rhcmxp"
    "bmdzLnNvbHZlci52MS5UZXJtUgV0ZXJtcxI4Cgljb25zdGFudHMYDSADKAsyGi5zdGFybGluZ3Muc29sdmVyLnYxLk5hbWVkUglj"
    "b25zdGFudHMSGAoHc2NyYXRjaBgOIAEoCVIHc2NyYXRjaEIICgZfc3RhdGVCCAoGX3N0YXJ0IkAKBU5hbWVkEhIKBG5hbWUYASAB"
    "KAlSBG5hbWUSGQoFdmFsdWUYAiABKAFIAFIFdmFsdWWIAQFCCAoGX3ZhbHVlIjIKCE9ic2VydmVyEhIKBGtpbmQYASABKAlSBGtp"
    "bmQSEgoEZ2FpbhgCIAEoAVIEZ2FpbiI2CgZTaWduYWwSFAoFdGltZXMYASABKAxSBXRpbWVzEhYKBnZhbHVlcxgCIAEoDFIGdmFs"
    "dWVzIjwKBFRlcm0SFAoFc3RhdGUYASABKAlSBXN0YXRlEh4KCmV4cHJlc3Npb24YAiABKAlSCmV4cHJlc3Npb24ixgEKCFJ1blJl"
    "cGx5EjsKCHByb2dyZXNzGAEgASgLMh0uc3RhcmxpbmdzLnNvbHZlci52MS5Qcm9ncmVzc0gAUghwcm9ncmVzcxI7CghmaW5pc2hl"
    "ZBgCIAEoCzIdLnN0YXJsaW5ncy5zb2x2ZXIudjEuRmluaXNoZWRIAFIIZmluaXNoZWQSOAoHZmFpbHVyZRgDIAEoCzIcLnN0YXJs"
    "aW5ncy5zb2x2ZXIudjEuRmFpbHVyZUgAUgdmYWlsdXJlQgYKBGtpbmQiLAoIUHJvZ3Jlc3MSFwoEdGltZRgBIAEoAUgAUgR0aW1l"
    "iAEBQgcKBV90aW1lIjoKCEZpbmlzaGVkEhgKB291dHB1dHMYASABKAxSB291dHB1dHMSFAoFc3RhdGUYAiABKAxSBXN0YXRlItAB"
    "CgdGYWlsdXJlEjUKBGtpbmQYASABKA4yIS5zdGFybGluZ3Muc29sdmVyLnYxLkZhaWx1cmUuS2luZFIEa2luZBISCgR0ZXh0GAIg"
    "ASgJUgR0ZXh0EhcKBHRpbWUYAyABKAFIAFIEdGltZYgBASJYCgRLaW5kEgoKBlNPTFZFUhAAEg4KCk5PVF9GSU5JVEUQARIPCgtC"
    "QURfUkVRVUVTVBACEhIKDk9VVFNJREVfRE9NQUlOEAMSDwoLVU5BVkFJTEFCTEUQBEIHCgVfdGltZTKlAQoGU29sdmVyElIKCERl"
    "c2NyaWJlEiQuc3RhcmxpbmdzLnNvbHZlci52MS5EZXNjcmliZVJlcXVlc3QaIC5zdGFybGluZ3Muc29sdmVyLnYxLkRlc2NyaXB0"
    "aW9uEkcKA1J1bhIfLnN0YXJsaW5ncy5zb2x2ZXIudjEuUnVuUmVxdWVzdBodLnN0YXJsaW5ncy5zb2x2ZXIudjEuUnVuUmVwbHkw"
    "AWIGcHJvdG8z"
)

# A pool of its own: another copy of the same file in the process does no harm.
_POOL = descriptor_pool.DescriptorPool()
_POOL.Add(descriptor_pb2.FileDescriptorProto.FromString(_DESCRIPTION))


def _message(name):
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName("starlings.solver.v1." + name))


DescribeRequest = _message("DescribeRequest")
Description = _message("Description")
Quantity = _message("Quantity")
Measure = _message("Measure")
RunRequest = _message("RunRequest")
Named = _message("Named")
Observer = _message("Observer")
Signal = _message("Signal")
Term = _message("Term")
RunReply = _message("RunReply")
Progress = _message("Progress")
Finished = _message("Finished")
Failure = _message("Failure")
