// The messages of tryon.v1 that the page uses, field by field as in proto/tryon/v1 (a test compares the two).

const schema = (name, ...fields) => ({ name, fields });

export const FrameId = schema('FrameId',
  [1, 'epoch', 'uint64'],
  [2, 'sequence', 'uint64'],
  [3, 'capture_time_ns', 'uint64'],
  [4, 'received_unix_ns', 'uint64'],
  [5, 'trace', 'uint64']);

export const StageTime = schema('StageTime',
  [1, 'stage', 'string'],
  [2, 'ms', 'float']);

export const RegionFit = schema('RegionFit',
  [1, 'region', 'string'],
  [2, 'fit', 'enum'],
  [3, 'stretch', 'float'],
  [4, 'pressure', 'float'],
  [5, 'touching', 'float'],
  [6, 'gap', 'float'],
  [7, 'ease', 'float?'],
  [8, 'ease_needed', 'float?']);

export const GarmentFit = schema('GarmentFit',
  [1, 'garment', 'string'],
  [2, 'size', 'string'],
  [3, 'regions', 'message[]', RegionFit],
  [4, 'tightness', 'bytes'],
  [5, 'hem_above', 'float?'],
  [6, 'hem_mark', 'string'],
  [7, 'provisional', 'bool']);

export const GarmentPrint = schema('GarmentPrint',
  [1, 'kind', 'enum'],
  [2, 'color_rgb', 'uint32'],
  [3, 'period', 'float']);

export const GarmentChoice = schema('GarmentChoice',
  [1, 'garment', 'string'],
  [2, 'size', 'string'],
  [3, 'color_rgb', 'uint32?'],
  [4, 'print', 'message', GarmentPrint]);

export const GarmentInfo = schema('GarmentInfo',
  [1, 'name', 'string'],
  [2, 'title', 'string'],
  [3, 'category', 'string'],
  [4, 'sizes', 'string[]'],
  [5, 'color_rgb', 'uint32']);

export const Consent = schema('Consent', [1, 'given', 'bool']);

export const OpenTryOnRequest = schema('OpenTryOnRequest',
  [1, 'try_on_id', 'string'],
  [2, 'store', 'string'],
  [3, 'camera', 'string'],
  [4, 'garments', 'message[]', GarmentChoice],
  [5, 'consent', 'message', Consent]);

export const OpenTryOnResponse = schema('OpenTryOnResponse',
  [1, 'try_on_id', 'string'],
  [2, 'created', 'bool']);

export const CloseTryOnRequest = schema('CloseTryOnRequest',
  [1, 'try_on_id', 'string']);

export const CloseTryOnResponse = schema('CloseTryOnResponse');

export const WithdrawConsentRequest = schema('WithdrawConsentRequest',
  [1, 'try_on_id', 'string']);

export const WithdrawConsentResponse = schema('WithdrawConsentResponse');

export const ChooseGarmentsRequest = schema('ChooseGarmentsRequest',
  [1, 'try_on_id', 'string'],
  [2, 'garments', 'message[]', GarmentChoice]);

export const ChooseGarmentsResponse = schema('ChooseGarmentsResponse',
  [1, 'outfit_revision', 'uint64']);

export const ShowFitRequest = schema('ShowFitRequest',
  [1, 'try_on_id', 'string'],
  [2, 'show', 'bool']);

export const ShowFitResponse = schema('ShowFitResponse');

export const ListGarmentChoicesRequest = schema('ListGarmentChoicesRequest');

export const ListGarmentChoicesResponse = schema('ListGarmentChoicesResponse',
  [1, 'garments', 'message[]', GarmentInfo]);

export const StreamFramesRequest = schema('StreamFramesRequest',
  [1, 'try_on_id', 'string'],
  [2, 'width', 'uint32'],
  [3, 'height', 'uint32'],
  [4, 'codec', 'enum'],
  [5, 'quality', 'uint32'],
  [6, 'max_rate', 'float'],
  [7, 'max_unacknowledged', 'uint32'],
  [8, 'framing', 'enum']);

export const PartOffPerson = schema('PartOffPerson',
  [1, 'part', 'string'],
  [2, 'share', 'float']);

export const GarmentOffPerson = schema('GarmentOffPerson',
  [1, 'share', 'float'],
  [2, 'parts', 'message[]', PartOffPerson]);

export const Picture = schema('Picture',
  [1, 'frame', 'message', FrameId],
  [2, 'state', 'enum'],
  [3, 'reason', 'enum'],
  [4, 'degraded_age', 'float'],
  [5, 'codec', 'enum'],
  [6, 'width', 'uint32'],
  [7, 'height', 'uint32'],
  [8, 'image', 'bytes'],
  [9, 'outfit_revision', 'uint64'],
  [10, 'latency_ms', 'float'],
  [11, 'stages', 'message[]', StageTime],
  [12, 'dropped', 'uint64'],
  [13, 'fit', 'message[]', GarmentFit],
  [14, 'cloth_detail', 'enum'],
  [15, 'off_person', 'message', GarmentOffPerson]);

export const AcknowledgeFramesRequest = schema('AcknowledgeFramesRequest',
  [1, 'try_on_id', 'string'],
  [2, 'stream', 'uint64'],
  [3, 'number', 'uint64']);

export const AcknowledgeFramesResponse = schema('AcknowledgeFramesResponse');

export const TryOnStatus = schema('TryOnStatus',
  [1, 'state', 'enum'],
  [2, 'reason', 'enum'],
  [3, 'age', 'float'],
  [4, 'service', 'string'],
  [5, 'detail', 'string'],
  [6, 'retry_after', 'float'],
  [7, 'end', 'enum']);

/** One of the two is set. */
export const StreamFramesResponse = schema('StreamFramesResponse',
  [1, 'picture', 'message', Picture],
  [2, 'status', 'message', TryOnStatus],
  [3, 'stream', 'uint64'],
  [4, 'number', 'uint64']);

export const TakeSnapshotRequest = schema('TakeSnapshotRequest',
  [1, 'try_on_id', 'string'],
  [2, 'codec', 'enum']);

export const TakeSnapshotResponse = schema('TakeSnapshotResponse',
  [1, 'picture', 'message', Picture]);

export const DrapeStep = schema('DrapeStep',
  [1, 'vertex_count', 'uint32'],
  [2, 'steps', 'uint32'],
  [3, 'motion', 'float'],
  [4, 'settled', 'bool']);

export const TakeFinePictureRequest = schema('TakeFinePictureRequest',
  [1, 'try_on_id', 'string'],
  [2, 'vertices', 'uint32'],
  [3, 'codec', 'enum']);

/** One of the two is set. */
export const TakeFinePictureResponse = schema('TakeFinePictureResponse',
  [1, 'drape', 'message', DrapeStep],
  [2, 'picture', 'message', Picture]);

export const OfferPhotoRequest = schema('OfferPhotoRequest',
  [1, 'try_on_id', 'string']);

export const OfferPhotoResponse = schema('OfferPhotoResponse',
  [1, 'url', 'string'],
  [2, 'qr_svg', 'string'],
  [3, 'seconds', 'float'],
  [4, 'picture', 'message', Picture]);

/** `PICTURE_CODEC_*` */
export const Codec = Object.freeze({ JPEG: 1, PNG: 2 });

/** `PICTURE_FRAMING_*` */
export const Framing = Object.freeze({ CONTAIN: 1, COVER: 2 });

/** `TRY_ON_STATE_*` */
export const State = Object.freeze({ OPENING: 1, CALIBRATING: 2, LIVE: 3, DEGRADED: 4, DRAINING: 5, CLOSED: 6 });

/** `TRY_ON_END_*` */
export const End = Object.freeze({ REQUESTED: 1, WITHDRAWN: 2, IDLE: 3 });

/** `DEGRADED_REASON_*` */
export const Reason = Object.freeze({
  NO_PERSON: 1,
  PERSON_LEFT: 2,
  TRACKING_LOST: 3,
  CAMERA_SILENT: 4,
  TRACKING_UNAVAILABLE: 5,
  CLOTH_UNAVAILABLE: 6,
  GARMENTS_LATE: 7,
  STEP_FAILED: 8,
  PERSON_SITS: 9,
  GARMENT_OFF_PERSON: 10,
});

/** `CLOTH_DETAIL_*` */
export const ClothDetail = Object.freeze({ FULL: 1, COARSE: 2, SKINNED: 3, NONE: 4 });

// google.rpc, for the details of an error.
export const Any = schema('Any', [1, 'type_url', 'string'], [2, 'value', 'bytes']);
export const Status = schema('Status', [1, 'code', 'uint32'], [2, 'message', 'string'], [3, 'details', 'message[]', Any]);
export const Duration = schema('Duration', [1, 'seconds', 'uint64'], [2, 'nanos', 'uint32']);
export const RetryInfo = schema('RetryInfo', [1, 'retry_delay', 'message', Duration]);
export const FieldViolation = schema('FieldViolation', [1, 'field', 'string'], [2, 'description', 'string']);
export const BadRequest = schema('BadRequest', [1, 'field_violations', 'message[]', FieldViolation]);

/** `FIT_CLASS_*`, in words */
export const FIT = Object.freeze(['', 'tight', 'fitted', 'loose']);
